// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_log.h"

#include "scenes/input_file.h"
#include "tools/settings/json_file.h"
#include "tools/workspace/scene_setup.h"

#include <nlohmann/json.hpp>

#include <cerrno>

namespace shadowdag {

ViewLog::ViewLog(const std::string& path) {
    if (path.empty())
        return;
    checkWritable(path);
    errno = 0;
    file_.open(path, std::ios::trunc);
    if (!file_)
        refuseTooManyFiles(path, errno);
    if (!file_)
        throw Error(ErrorKind::kResource, path + ": cannot be written; name another file");
}

void ViewLog::write(const char* name, Json fields) {
    if (!isOn())
        return;
    Json line = {{"event", name}};
    line.update(fields);
    file_ << jsonLine(line) << std::endl;
}

} // namespace shadowdag
