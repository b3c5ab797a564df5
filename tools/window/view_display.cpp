// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_display.h"

#include "cuda/error.h"

#include <X11/Xlib.h>
#include <unistd.h>

#include <csignal>
#include <iostream>

namespace shadowdag {

void endWithTheDisplay() {
    // Writing to a closed connection then fails as reading does. A handler that is set stays: it
    // also tells a broken pipe from a SIGPIPE that asks the process to end.
    struct sigaction before {};
    sigaction(SIGPIPE, nullptr, &before);
    if (before.sa_handler == SIG_DFL)
        std::signal(SIGPIPE, SIG_IGN);
    XSetIOErrorHandler([](Display*) -> int {
        std::cerr << "shadowdag: error: the connection to the display was lost" << std::endl;
        _exit(int(ErrorKind::kDevice));
    });
}

} // namespace shadowdag
