#pragma once
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/process.h"

namespace taihu {

/// What a command prints with --json; it has to end well, and to say nothing else.
inline nlohmann::json result(const std::string& command, const Scratch& folder) {
    const Finished said = run(command + " --json -q", folder.path());
    EXPECT_EQ(said.exit_code, 0) << command << '\n' << said.err;
    EXPECT_EQ(said.err, "") << command;
    const auto object = nlohmann::json::parse(said.out, nullptr, false);
    EXPECT_TRUE(object.is_object()) << command << '\n' << said.out;
    return object;
}

/// Runs a command that has to end well.
inline void must(const std::string& command, const Scratch& folder) {
    const Finished said = run(command, folder.path());
    EXPECT_EQ(said.exit_code, 0) << command << '\n' << said.err;
}

} // namespace taihu
