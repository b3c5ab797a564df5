// SPDX-License-Identifier: Apache-2.0
// The file of a study: rows and bounds as JSON. The program's own studies are in scenes/studies/
// and embedded in the program. docs/studies.md describes the schema.
#pragma once

#include "tools/settings/key_reader.h"

#include <nlohmann/json.hpp>

#include <functional>
#include <string>
#include <vector>

namespace shadowdag {

struct StudyFile {
    std::string name; ///< the file's, without directories and extension
    std::string path; ///< prefix of messages
    Json json;
};

/// Returns the program's own studies, by name.
const std::vector<StudyFile>& shippedStudies();

/// Returns the study of an argument: one of the program's own, or a file ending in .json. Throws
/// Error kUsage for an unknown name, listing the known ones, and as readJsonFile does.
StudyFile findStudy(const std::string& argument);

inline constexpr const char* const kOffOn[] = {"off", "on"};

/// Reads an object of a study key by key; messages name file and row. Nested objects are read by a
/// function that gets their reader; keys that it leaves unread are refused.
class StudyReader : public KeyReader {
public:
    using Visit = std::function<void(StudyReader&)>;

    StudyReader(const Json& json, const std::string& where)
        : KeyReader(json, where), json_(json), where_(where) {}

    /// Returns a required text, which must not be empty.
    std::string required(const char* key);
    /// Reads a required number.
    template <class T> void requiredNumber(const char* key, T& value, double min, double max) {
        if (!find(key))
            throw Error(ErrorKind::kInput,
                        where_ + ": key \"" + key + "\" is missing; it must be a number");
        number(key, value, min, max);
    }
    /// Returns the index of a required text among names.
    template <size_t N> size_t choice(const char* key, const char* const (&names)[N]) {
        return choiceOf(key, {names, names + N});
    }
    /// The same for a list, not empty.
    template <size_t N>
    std::vector<size_t> choices(const char* key, const char* const (&names)[N]) {
        return choicesOf(key, {names, names + N});
    }
    /// Returns settings of cells, "" if there are none; invalid ones are refused.
    std::string settings(const char* key);
    /// Reads an optional object.
    void object(const char* key, const Visit& visit);
    /// Reads an optional list of objects. @param what the name of an element in messages
    void list(const char* key, const std::string& what, const Visit& visit);
    /// Reads the list "rows"; their names, of letters, digits, '-', '_' and '.', must differ.
    void rows(const Visit& visit);
    /// Throws Error kInput if `count`, the number of rows read, is 0.
    void requireRows(size_t count) const;

private:
    size_t choiceOf(const char* key, const std::vector<std::string>& names);
    std::vector<size_t> choicesOf(const char* key, const std::vector<std::string>& names);

    const Json& json_;
    std::string where_;
};

/// Reads a whole study: the common keys ("kind", "title", "what") and those that `visit` reads.
void readStudy(const StudyFile& file, const StudyReader::Visit& visit);

/// Returns the indices of the rows of these names, in the given order; all if there are none.
/// Throws Error kUsage, naming --only, for an unknown one.
std::vector<size_t> chooseRows(const std::vector<std::string>& all,
                               const std::vector<std::string>& names);

} // namespace shadowdag
