// SPDX-License-Identifier: Apache-2.0
// Handles the end of the X server.
#pragma once

namespace shadowdag {

/// Makes the program end at once when the X server goes away, with the exit status of a device
/// error and a line on standard error. Xlib would call exit(), which destroys objects that the
/// worker's threads still use. Files are complete or absent, as when the program is killed.
void endWithTheDisplay();

} // namespace shadowdag
