#pragma once
#include <string>

#include "tools/console.h"

namespace taihu {

/// All verbs, in the order of the help.
void add_verbs(CLI::App& app, Console& console);

/// Runs a command as it would be typed, in this process and its folder, and returns what it prints
/// with --json; nothing is said.
/// \param command  `taihu VERB ...`, words between spaces.
/// \throws Error  the verb's; bad_argument: no such verb or option; bad_input: a verb that says no.
nlohmann::ordered_json run_command(const std::string& command, Progress* progress);

} // namespace taihu
