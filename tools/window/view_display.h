// SPDX-License-Identifier: Apache-2.0
// The X server's end.
#pragma once

namespace shadowdag {

/// From now on the program ends at once where the X server goes away, with the status of an error
/// of the device and a line on standard error. Xlib would call exit(), which ends what the worker's
/// threads still use. Files are whole or not there, as where the program is killed.
void endWithTheDisplay();

} // namespace shadowdag
