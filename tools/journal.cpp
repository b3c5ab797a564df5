// SPDX-License-Identifier: Apache-2.0
#include "tools/journal.h"

#include "cuda/error.h"
#include "scenes/output_file.h"

#include <fstream>
#include <sstream>

namespace shadowdag {

Journal::Journal(std::string path, std::string key, bool resume) : path_(std::move(path)) {
    content_ = {{"key", key}, {"parts", Json::object()}};
    std::ifstream file(path_, std::ios::binary);
    if (!resume || !file)
        return;
    std::stringstream text;
    text << file.rdbuf();
    Json found = Json::parse(text.str(), nullptr, false);
    if (found.is_discarded() || !found.is_object() || !found.contains("key") ||
        !found.contains("parts") || !found["parts"].is_object())
        throw Error(ErrorKind::kInput, path_ + ": is damaged; delete it, or run without --resume");
    if (found["key"] != content_["key"])
        throw Error(ErrorKind::kUsage,
                    path_ + ": belongs to another compare (program, experiment, scenes or backend "
                            "differ); run without --resume, or into another directory");
    content_ = std::move(found);
    takenUpCount_ = content_["parts"].size();
}

const Json* Journal::find(const std::string& part) const {
    const Json& parts = content_["parts"];
    const auto found = parts.find(part);
    return found == parts.end() ? nullptr : &*found;
}

void Journal::set(const std::string& part, Json value) {
    content_["parts"][part] = std::move(value);
    OutputFile file(path_);
    file.write(content_.dump(-1, ' ', false, Json::error_handler_t::replace));
    file.commit();
}

} // namespace shadowdag
