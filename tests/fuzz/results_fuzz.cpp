// SPDX-License-Identifier: Apache-2.0
// Results of a part of a compare, joined to a report; their checksum is kept right.
#include "tests/fuzz/json_seeds.h"
#include "tools/commands/compare_parts.h"
#include "tools/report/csv.h"

namespace shadowdag::fuzz::results {

namespace {

void fuzzOne(const uint8_t* data, size_t size) {
    fuzzFolder().write("part.json", data, size);
    const std::string costs = "{\"costs\": []}\n";
    fuzzFolder().write("costs.json", reinterpret_cast<const uint8_t*>(costs.data()), costs.size());
    const CompareFindings findings = joinParts({fuzzFolder().path()});
    runsCsv(findings.results["runs"]);
}

std::string pack(const std::string& content) {
    Json json = parseOwnJson(content);
    if (!json.is_object())
        return content;
    json["content_hash"] = partHash(json);
    return jsonLine(json);
}

std::vector<std::string> seeds() {
    const std::string costs = "{\"costs\": []}\n";
    fuzzFolder().write("costs.json", reinterpret_cast<const uint8_t*>(costs.data()), costs.size());
    const Json report = sourceJson("tests/bench/results/compare-atrium.json", 2);
    CompareFindings findings(report["provenance"], report["experiment"]);
    std::vector<std::string> files;
    for (const size_t runs : {1, 2}) {
        for (size_t i = 0; i < runs; ++i) {
            Json run = report["runs"][i];
            run.erase("images");
            findings.results["runs"].push_back(run);
        }
        findings.lights.push_back({{"scene", "atrium"}, {"light", 3}, {"pair_count", 70}});
        files.push_back(
            jsonLine(toJson(findings, {1, 1}, {{"commit", "0123"}}, fuzzFolder().path())));
    }
    return files;
}

[[maybe_unused]] const bool isAdded = addFuzzTarget(
    {.name = "results", .maxBytes = 16384, .fuzzOne = fuzzOne, .seeds = seeds, .pack = pack});

} // namespace

} // namespace shadowdag::fuzz::results
