#pragma once
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "stats/core/error.h"

namespace taihu {

/// Plain values one after the other, in the byte order of this machine: what a helper program hands
/// to the program that started it.
class FlatWriter {
public:
    template <class T>
    requires std::is_trivially_copyable_v<T>
    void put(const T& value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); }
    template <class T>
    void put_all(std::span<const T> values) {
        put<std::uint64_t>(values.size());
        bytes.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
    }
    void put_text(std::string_view text) { put_all(std::span(text.data(), text.size())); }

    std::string bytes;
};

/// The other way; believes no count.
class FlatReader {
public:
    /// \param where  stands for the bytes in messages.
    FlatReader(std::string_view bytes, std::string where)
        : bytes_(bytes), where_(std::move(where)) {}

    /// \throws Error bad_input: fewer bytes are left.
    template <class T>
    requires std::is_trivially_copyable_v<T> T get() {
        T value;
        std::memcpy(&value, take(sizeof value).data(), sizeof value);
        return value;
    }
    /// A vector or a string of what put_all() wrote.
    template <class Values>
    Values get_all() {
        using T = typename Values::value_type;
        const auto n = get<std::uint64_t>();
        if (n > bytes_.size() / sizeof(T))
            fail("ends early");
        Values values(static_cast<std::size_t>(n), T{});
        const std::string_view from = take(static_cast<std::size_t>(n) * sizeof(T));
        if (n > 0)
            std::memcpy(values.data(), from.data(), from.size());
        return values;
    }
    std::string get_text() { return get_all<std::string>(); }
    /// \throws Error bad_input: something is left.
    void expect_end() const {
        if (!bytes_.empty())
            fail("goes on");
    }
    [[noreturn]] void fail(const std::string& what) const {
        throw Error(Fault::bad_input,
                    where_ + ": damaged: what its reader says " + what + "; write the file again");
    }

private:
    std::string_view take(std::size_t n) {
        if (n > bytes_.size())
            fail("ends early");
        const std::string_view out = bytes_.substr(0, n);
        bytes_.remove_prefix(n);
        return out;
    }
    std::string_view bytes_;
    std::string where_;
};

} // namespace taihu
