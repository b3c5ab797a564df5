// SPDX-License-Identifier: Apache-2.0
// --log of the window: one line of JSON per event, for scripts and tests.
#pragma once

#include "tools/settings/json.h"

#include <fstream>
#include <string>

namespace shadowdag {

/// Writes lines immediately. Does nothing without a path.
class ViewLog {
public:
    /// Throws Error kResource when the file cannot be written.
    explicit ViewLog(const std::string& path);
    /// Writes {"event": name, ...fields} as one line at once.
    void write(const char* name, Json fields);
    bool isOn() const { return file_.is_open(); }

private:
    std::ofstream file_;
};

} // namespace shadowdag
