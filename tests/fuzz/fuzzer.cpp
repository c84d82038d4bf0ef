// A libFuzzer target of one format, TAIHU_FUZZ_FORMAT.
#include <cstdint>
#include <cstdlib>

#include "stats/core/error.h"
#include "tests/fuzz/formats.h"
#include "tests/support/scratch.h"

namespace {

const taihu::FuzzFormat& fuzzed() {
    for (const taihu::FuzzFormat& format : taihu::fuzz_formats())
        if (format.name == TAIHU_FUZZ_FORMAT)
            return format;
    std::abort();
}

} // namespace

/// Whatever is no Error leaves as it is, and libFuzzer keeps the file.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const taihu::Scratch scratch;
    try {
        fuzzed().read(std::string(reinterpret_cast<const char*>(data), size), scratch.path());
    } catch (const taihu::Error&) {
    }
    return 0;
}
