// SPDX-License-Identifier: Apache-2.0
#include "scenes/write_remedy.h"

#include <cerrno>

namespace shadowdag {

std::string writeRemedy(int error) {
    switch (error) {
    case EFBIG:
        return "raise the limit of the shell on the size of files (ulimit -f)";
    case ENAMETOOLONG: // OutputFile appends to it
        return "choose a shorter name; that of an unfinished file is longer than the output's";
    case EDQUOT:
        return "the quota of the disk is used up; free some of it or choose another place";
    default:
        return "choose another place or free some disk space";
    }
}

} // namespace shadowdag
