#pragma once
#include <string>
#include <utility>

#include "stats/core/error.h"

namespace taihu {

/// Does work on what a file says. What it refuses of that is then bad_input, not bad_argument, and
/// the message names the file.
/// \param where  the file's name, in messages.
template <class Work>
auto of_file(const std::string& where, Work&& work) {
    try {
        return std::forward<Work>(work)();
    } catch (const Error& e) {
        const std::string what = e.what();
        if (e.fault() == Fault::io || e.fault() == Fault::cancelled)
            throw;
        throw Error(e.fault() == Fault::bad_argument ? Fault::bad_input : e.fault(),
                    what.find(where) == std::string::npos ? where + ": " + what : what);
    }
}

} // namespace taihu
