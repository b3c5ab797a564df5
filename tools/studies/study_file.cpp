// SPDX-License-Identifier: Apache-2.0
#include "tools/studies/study_file.h"

#include "tools/studies/cell_setup.h"
#include "tools/studies/shipped_studies.h"

#include <filesystem>

namespace shadowdag {

namespace {

constexpr const char* kRemedy = "give a study file, as in scenes/studies";

std::string listed(const std::vector<std::string>& names) {
    std::string all;
    for (const std::string& name : names)
        all += (all.empty() ? "" : ", ") + name;
    return all;
}

} // namespace

const std::vector<StudyFile>& shippedStudies() {
    static const std::vector<StudyFile> studies = [] {
        std::vector<StudyFile> list;
        for (const ShippedStudy& shipped : kShippedStudies) {
            const std::string path = std::string("scenes/studies/") + shipped.name + ".json";
            list.push_back({shipped.name, path, parseJson(shipped.text, path, kRemedy)});
        }
        return list;
    }();
    return studies;
}

StudyFile findStudy(const std::string& argument) {
    if (argument.ends_with(".json"))
        return {std::filesystem::path(argument).stem().string(), argument,
                readJsonFile(argument, kRemedy)};
    std::vector<std::string> names;
    for (const StudyFile& study : shippedStudies()) {
        if (study.name == argument)
            return study;
        names.push_back(study.name);
    }
    throw Error(ErrorKind::kUsage, "STUDY '" + argument + "': must be one of " + listed(names) +
                                       ", or a file ending in .json");
}

std::string StudyReader::required(const char* key) {
    std::string value;
    text(key, value);
    if (value.empty())
        throw Error(ErrorKind::kInput,
                    where_ + ": key \"" + key + "\" is missing; it must be a text");
    return value;
}

size_t StudyReader::choiceOf(const char* key, const std::vector<std::string>& names) {
    const std::string value = required(key);
    const auto found = std::find(names.begin(), names.end(), value);
    if (found == names.end())
        refuse(key, value, "must be one of " + listed(names));
    return size_t(found - names.begin());
}

std::vector<size_t> StudyReader::choicesOf(const char* key, const std::vector<std::string>& names) {
    std::vector<std::string> values;
    texts(key, values);
    std::vector<size_t> chosen;
    for (const std::string& value : values) {
        const auto found = std::find(names.begin(), names.end(), value);
        if (found == names.end())
            refuse(key, value, "must contain some of " + listed(names));
        chosen.push_back(size_t(found - names.begin()));
    }
    if (chosen.empty())
        refuse(key, json_.value(key, Json()), "must contain some of " + listed(names));
    return chosen;
}

std::string StudyReader::settings(const char* key) {
    std::string value;
    text(key, value);
    try {
        cellSetup({value});
    } catch (const Error& error) {
        throw Error(ErrorKind::kInput, where_ + ": key \"" + key + "\": " + error.what());
    }
    return value;
}

void StudyReader::object(const char* key, const Visit& visit) {
    if (const Json* found = find(key)) {
        StudyReader reader(*found, where_ + ": " + key);
        visit(reader);
        reader.finish();
    }
}

void StudyReader::list(const char* key, const std::string& what, const Visit& visit) {
    const Json* found = find(key);
    if (!found)
        return;
    size_t number = 0;
    requireList(key, *found);
    for (const Json& item : *found) {
        std::string where = where_ + ": " + what + " " + std::to_string(++number);
        for (const char* id : {"name", "case"})
            if (item.is_object() && item.contains(id) && item[id].is_string())
                where += ", \"" + item[id].get<std::string>() + "\"";
        StudyReader reader(item, where);
        visit(reader);
        reader.finish();
    }
}

void StudyReader::rows(const Visit& visit) {
    std::set<std::string> names;
    list("rows", "row", [&](StudyReader& row) {
        const std::string name = row.required("name");
        if (name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                                   "-_.") != std::string::npos)
            row.refuse("name", name, "must be of letters, digits, '-', '_' and '.'");
        if (!names.insert(name).second)
            row.refuse("name", name, "is listed twice; list each row once");
        visit(row);
    });
}

void StudyReader::requireRows(size_t count) const {
    if (count == 0)
        refuse("rows", json_.value("rows", Json()), "must contain at least one row");
}

void readStudy(const StudyFile& file, const StudyReader::Visit& visit) {
    StudyReader reader(file.json, file.path);
    reader.required("kind");
    reader.required("title");
    reader.required("what");
    visit(reader);
    reader.finish();
}

std::vector<size_t> chooseRows(const std::vector<std::string>& all,
                               const std::vector<std::string>& names) {
    std::vector<size_t> chosen;
    for (const std::string& name : names) {
        const auto found = std::find(all.begin(), all.end(), name);
        if (found == all.end())
            throw Error(ErrorKind::kUsage, "--only '" + name + "': must be one of " + listed(all));
        chosen.push_back(size_t(found - all.begin()));
    }
    for (size_t i = 0; names.empty() && i < all.size(); ++i)
        chosen.push_back(i);
    return chosen;
}

} // namespace shadowdag
