#include "stats/core/foreign.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "stats/core/flat.h"
#include "tests/support/errors.h"
#include "tests/support/scratch.h"

namespace taihu {
namespace {

/// While it lives, reading is done by a shell script instead.
class OtherReader {
public:
    explicit OtherReader(const std::string& script) {
        const auto program = folder_.path() / "reader";
        std::ofstream(program) << "#!/bin/sh\n" << script << '\n';
        std::filesystem::permissions(program, std::filesystem::perms::owner_all);
        ::setenv("TAIHU_READER", program.c_str(), 1);
    }
    ~OtherReader() { ::unsetenv("TAIHU_READER"); }

private:
    Scratch folder_;
};

struct Cancelled final : Progress {
    void stage(std::string_view) override {}
    void fraction(double) override {}
    bool cancelled() const override { return true; }
};

TEST(Foreign, LimitsGrowWithTheBytes) {
    EXPECT_EQ(foreign_limits(0).processor_s, 2u);
    EXPECT_EQ(foreign_limits(100'000'000).processor_s, 12u);
    EXPECT_EQ(foreign_limits(0).memory_bytes, std::uint64_t{768} << 20);
    EXPECT_EQ(foreign_limits(10).memory_bytes, (std::uint64_t{768} << 20) + 1000);
}

TEST(Foreign, HandsBytesOverAndTheAnswerBack) {
    // The first byte says that it was found; the rest is what came in.
    const OtherReader reader("printf '\\0'; cat");
    const std::string bytes("a\0b\nc", 5);
    EXPECT_EQ(read_foreign("any", bytes, "file"), bytes);
    EXPECT_EQ(read_foreign("any", "", "file"), "");
    const std::string large(5'000'000, 'x');
    EXPECT_EQ(read_foreign("any", large, "file"), large);
}

TEST(Foreign, WordsReachTheReader) {
    const OtherReader reader("printf '\\0'; printf '%s|' \"$@\"");
    EXPECT_EQ(read_foreign("kind", "", "the file", {"one", "two words"}),
              "kind|the file|one|two words|");
}

TEST(Foreign, WhatItSaysOnItsOtherStreamsIsForNobody) {
    testing::internal::CaptureStderr();
    const OtherReader reader("printf '\\0'; seq 30000 >&2; printf done");
    EXPECT_EQ(read_foreign("any", "", "file"), "done");
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(Foreign, CrashesAndExitCodesAreDamagedFiles) {
    for (const char* script : {"kill -SEGV $$", "kill -XCPU $$", "exit 3"}) {
        const OtherReader reader(script);
        expect_error(Fault::bad_input,
                     "rock.vdb: damaged: reading it took more than 2 s and 768 MB, or crashed; "
                     "write the file again",
                     [] { read_foreign("any", "", "rock.vdb"); });
    }
}

TEST(Foreign, AnswersThatAreNoneAreRefused) {
    for (const char* script : {"true", "printf '\\1'", "printf '\\1\\377\\377\\377\\377'",
                               "printf '\\1\\1\\0\\0\\0abc'"}) {
        const OtherReader reader(script);
        expect_error(Fault::bad_input, "rock.vdb: damaged: what its reader says",
                     [] { read_foreign("any", "", "rock.vdb"); });
    }
}

TEST(Foreign, StopsWhenItIsTold) {
    const OtherReader reader("sleep 100");
    Cancelled progress;
    expect_error(Fault::cancelled, "", [&] { read_foreign("any", "", "file", {}, &progress); });
}

TEST(Foreign, TheProgramRefusesWhatItIsNotMadeFor) {
    expect_error(Fault::bad_input, "file: damaged",
                 [] { read_foreign("no such kind", "x", "file"); });
    FlatWriter one;
    one.put<std::uint64_t>(1);
    one.put_text("file:byte 7");
    one.put_text("x");
    expect_error(Fault::bad_input, "file:byte 7: not a Draco stream",
                 [&] { read_foreign("draco", one.bytes, "file"); });
    expect_error(Fault::bad_input, "file: damaged", [] { read_foreign("draco", "x", "file"); });
}

TEST(Flat, GivesBackWhatWasPut) {
    FlatWriter out;
    out.put(7);
    out.put_text("text");
    out.put_all(std::span<const double>(std::vector{1.5, -2.0}));
    FlatReader in(out.bytes, "file");
    EXPECT_EQ(in.get<int>(), 7);
    EXPECT_EQ(in.get_text(), "text");
    EXPECT_EQ(in.get_all<std::vector<double>>(), (std::vector{1.5, -2.0}));
    in.expect_end();
}

TEST(Flat, BelievesNoCount) {
    FlatWriter out;
    out.put<std::uint64_t>(std::uint64_t{1} << 61); // times 8 is 0
    FlatReader in(out.bytes, "file");
    expect_error(Fault::bad_input, "ends early", [&] { in.get_all<std::vector<double>>(); });
    FlatReader rest("abc", "file");
    expect_error(Fault::bad_input, "ends early", [&] { rest.get<int>(); });
    expect_error(Fault::bad_input, "goes on", [&] { rest.expect_end(); });
}

} // namespace
} // namespace taihu
