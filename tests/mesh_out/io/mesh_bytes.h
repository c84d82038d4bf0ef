#pragma once
#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mesh_out/io/mesh_file.h"
#include "stats/core/error.h"
#include "stats/core/rng.h"

namespace taihu {

/// A regular tetrahedron, outward, volume 8/3.
inline TriMesh tetrahedron() {
    return {{{1, 1, 1}, {-1, -1, 1}, {-1, 1, -1}, {1, -1, -1}},
            {{0, 1, 3}, {0, 3, 2}, {0, 2, 1}, {1, 2, 3}},
            {}};
}

/// Reading `bytes` must fail with this fault and a message that holds all of `parts`, on one line.
inline void expect_refused(std::string_view bytes, MeshFormat format, Fault fault,
                           const std::vector<std::string>& parts) {
    try {
        parse_mesh(bytes, format, "rock");
        ADD_FAILURE() << "no exception for " << bytes.substr(0, 200);
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), fault) << e.what();
        EXPECT_THAT(e.what(), testing::StartsWith("rock:"));
        EXPECT_THAT(e.what(), testing::HasSubstr("; "));
        EXPECT_THAT(e.what(), testing::Not(testing::HasSubstr("\n")));
        for (const std::string& part : parts)
            EXPECT_THAT(e.what(), testing::HasSubstr(part));
    }
}

inline void expect_sound(const MeshFile& file) {
    for (const TriMesh& level : file.levels) {
        EXPECT_FALSE(level.triangles.empty());
        for (const Triangle& t : level.triangles)
            for (const std::uint32_t corner : t)
                ASSERT_LT(corner, level.positions.size());
        for (const Vec3& p : level.positions)
            ASSERT_TRUE(is_finite(p));
    }
}

/// The mesh that `bytes` hold, or nothing when they are refused; anything else than Error escapes.
inline std::optional<MeshFile> try_parse(std::string_view bytes, MeshFormat format) {
    try {
        return parse_mesh(bytes, format, "rock", {.is_own = true}); // no process for each
    } catch (const Error& e) {
        EXPECT_THAT(e.what(), testing::StartsWith("rock:"));
        return std::nullopt;
    }
}

/// Every shorter version of `bytes` is refused, or (a text without its last line end) read the
/// same.
inline void expect_prefixes_refused(const std::string& bytes, MeshFormat format) {
    const MeshFile whole = parse_mesh(bytes, format, "rock");
    for (std::size_t n = 0; n < bytes.size(); ++n) {
        // A copy on the heap, so that a sanitizer sees a read past its end.
        const std::vector<char> part(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n));
        const auto file = try_parse({part.data(), part.size()}, format);
        if (!file)
            continue;
        EXPECT_EQ(file->levels.front().positions, whole.levels.front().positions) << n;
        EXPECT_EQ(file->levels.front().triangles, whole.levels.front().triangles) << n;
    }
}

/// `n` copies of `bytes` with one byte changed: each is refused, or read as a sound mesh.
inline void expect_mutations_safe(const std::string& bytes, MeshFormat format, int n) {
    const Rng rng{.seed = 7, .stream = static_cast<std::uint32_t>(format)};
    int n_refused = 0;
    for (int i = 0; i < n; ++i) {
        const auto words = rng.words(static_cast<std::uint64_t>(i));
        std::string changed = bytes;
        // Half of them swap in a character that text formats care about.
        static constexpr std::string_view kTelling = "0123456789 \n-+./#e\\\"[]{}:,nai";
        changed[words[0] % changed.size()] =
            words[1] % 2 == 0 ? static_cast<char>(words[2]) : kTelling[words[2] % kTelling.size()];
        const auto file = try_parse(changed, format);
        if (file)
            expect_sound(*file);
        else
            ++n_refused;
    }
    EXPECT_GT(n_refused, 0);
}

} // namespace taihu
