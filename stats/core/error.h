#pragma once
#include <stdexcept>
#include <string>

namespace taihu {

/// What kind of thing went wrong; the command line turns it into an exit code.
enum class Fault {
    bad_argument, ///< the caller's settings
    bad_input,    ///< what a file or a mesh says
    io,           ///< the file system
    unsupported,  ///< right, but not something this build does
    numeric,      ///< no answer was found within the promised tolerance
    cancelled     ///< Progress said so
};

/// The one exception taihu throws. The message reads `<where>: <what, with the value>; <remedy>`.
class Error : public std::runtime_error {
public:
    Error(Fault fault, const std::string& message) : std::runtime_error(message), fault_(fault) {}
    Fault fault() const noexcept { return fault_; }

private:
    Fault fault_;
};

} // namespace taihu
