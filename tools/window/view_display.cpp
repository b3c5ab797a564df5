// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_display.h"

#include "cuda/error.h"

#include <X11/Xlib.h>
#include <unistd.h>

#include <csignal>
#include <iostream>

namespace shadowdag {

void endWithTheDisplay() {
    std::signal(SIGPIPE, SIG_IGN); // writing to a closed connection fails as reading does
    XSetIOErrorHandler([](Display*) -> int {
        std::cerr << "shadowdag: error: the connection to the display was lost" << std::endl;
        _exit(int(ErrorKind::kDevice));
    });
}

} // namespace shadowdag
