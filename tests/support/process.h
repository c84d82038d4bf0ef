#pragma once
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <sys/wait.h>

#include "stats/core/file.h"
#include "tests/support/scratch.h"

namespace taihu {

/// What a finished program said.
struct Finished {
    int exit_code = -1;
    std::string out, err;
};

/// Run a shell command in `folder`, with `taihu` on the PATH, and wait for it.
inline Finished run(const std::string& command, const std::filesystem::path& folder) {
    static int n = 0;
    const auto out = folder / (".out" + std::to_string(n)),
               err = folder / (".err" + std::to_string(n));
    ++n;
    const std::string line = "cd '" + folder.string() +
                             "' && PATH='" TAIHU_PROGRAM_DIR "':$PATH && { " + command + "; } >'" +
                             out.string() + "' 2>'" + err.string() + "' </dev/null";
    const int status = std::system(line.c_str());
    Finished result{WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_file(out), read_file(err)};
    std::filesystem::remove(out);
    std::filesystem::remove(err);
    return result;
}

} // namespace taihu
