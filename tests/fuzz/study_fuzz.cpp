// SPDX-License-Identifier: Apache-2.0
// Study files of every kind, read up to their list of parts.
#include "tests/fuzz/json_seeds.h"
#include "tools/settings/console.h"
#include "tools/studies/study.h"

namespace shadowdag::fuzz::study {

namespace {

void fuzzOne(const uint8_t* data, size_t size) {
    const StudyFile file{"input", "input.json", inputJson(data, size)};
    const Console silent(Console::Listener{[](const std::string&) {}, {}});
    const std::unique_ptr<Study> study = makeStudy(file, {}, silent);
    fuzzCheck(!study->parts().empty(), "a study has parts");
    study->scenes();
    study->needsBeyondGl();
}

std::vector<std::string> seeds() {
    std::vector<std::string> files;
    for (const char* name :
         {"ablation", "adjudication", "failures", "mutants", "real", "stability"})
        files.push_back(jsonLine(sourceJson(std::string("scenes/studies/") + name + ".json", 2)));
    return files;
}

[[maybe_unused]] const bool isAdded =
    addFuzzTarget({.name = "study", .maxBytes = 8192, .fuzzOne = fuzzOne, .seeds = seeds});

} // namespace

} // namespace shadowdag::fuzz::study
