// SPDX-License-Identifier: Apache-2.0
// The file of a study: rows and bounds as JSON. Those that come with the program stand in
// scenes/studies/ and in the program itself. docs/studies.md describes the schema.
#pragma once

#include "tools/settings/key_reader.h"

#include <functional>
#include <string>
#include <vector>

namespace shadowdag {

struct StudyFile {
    std::string name; ///< the file's, without directories and extension
    std::string path; ///< heads complaints
    Json json;
};

/// Returns the studies that come with the program, by name.
const std::vector<StudyFile>& shippedStudies();

/// Returns the study that an argument names: one that comes with the program, or a file ending in
/// .json. Throws Error kUsage for an unknown name, listing the known ones, and as readJsonFile
/// does.
StudyFile findStudy(const std::string& argument);

inline constexpr const char* const kOffOn[] = {"off", "on"};

/// Reads an object of a study key by key; complaints name file and row. Objects within it are read
/// by a function that is given their reader; what it leaves unread is refused.
class StudyReader : public KeyReader {
public:
    using Visit = std::function<void(StudyReader&)>;

    StudyReader(const Json& json, const std::string& where)
        : KeyReader(json, where), json_(json), where_(where) {}

    /// Returns a text that must be there and not be empty.
    std::string required(const char* key);
    /// Returns which of the names a text is that must be there.
    template <size_t N> size_t choice(const char* key, const char* const (&names)[N]) {
        return choiceOf(key, {names, names + N});
    }
    /// The same of a list, not empty.
    template <size_t N>
    std::vector<size_t> choices(const char* key, const char* const (&names)[N]) {
        return choicesOf(key, {names, names + N});
    }
    /// Returns settings of cells, "" where there are none; those it cannot be are refused.
    std::string settings(const char* key);
    /// Reads an object that may be missing.
    void object(const char* key, const Visit& visit);
    /// Reads a list of objects that may be missing. @param what one of them is called in complaints
    void list(const char* key, const std::string& what, const Visit& visit);
    /// Reads the list "rows"; their names, of letters, digits and '-', must differ.
    void rows(const Visit& visit);

private:
    size_t choiceOf(const char* key, const std::vector<std::string>& names);
    std::vector<size_t> choicesOf(const char* key, const std::vector<std::string>& names);

    const Json& json_;
    std::string where_;
};

/// Reads a whole study: what all kinds have ("kind", "title", "what") and what `visit` reads.
void readStudy(const StudyFile& file, const StudyReader::Visit& visit);

/// Returns the indices of the rows of these names, in the order named; all of none.
/// Throws Error kUsage, naming --only, for an unknown one.
std::vector<size_t> chooseRows(const std::vector<std::string>& all,
                               const std::vector<std::string>& names);

} // namespace shadowdag
