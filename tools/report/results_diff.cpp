// SPDX-License-Identifier: Apache-2.0
#include "tools/report/results_diff.h"

#include "cuda/error.h"
#include "tools/report/results_identity.h"
#include "tools/report/results_rows.h"
#include "tools/settings/json_file.h"
#include "tools/settings/provenance.h"
#include "tools/settings/words.h"
#include "tools/workspace/journal.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

namespace shadowdag {

namespace {

std::string verdictOf(bool isMore, ResultDirection direction) {
    if (direction == ResultDirection::kNeither)
        return "changed";
    return isMore == (direction == ResultDirection::kMoreIsBetter) ? "better" : "worse";
}

Json toJson(const QuantileInterval& interval) {
    return {interval.low, interval.high};
}

/// Returns the names that only the first has.
Json namesOnlyIn(const std::set<std::string>& first, const std::set<std::string>& second) {
    Json only = Json::array();
    for (const std::string& name : first)
        if (!second.contains(name))
            only.push_back(name);
    return only;
}

/// Returns the change of what notices a fault: by how many it was and is, which no longer do and
/// which do now.
Json changeOfNames(const std::string& key, const std::set<std::string>& a,
                   const std::set<std::string>& b) {
    const Json lost = namesOnlyIn(a, b), gained = namesOnlyIn(b, a);
    if (lost.empty() && gained.empty())
        return {};
    const Json& bad = key == "noticed by" ? lost : gained;
    return {{"key", key},   {"a", a.size()},    {"b", b.size()},
            {"lost", lost}, {"gained", gained}, {"verdict", bad.empty() ? "better" : "worse"}};
}

/// The pairs of a and b where two rows differ in their number; else nothing.
using OtherPairs = std::optional<std::pair<double, double>>;

OtherPairs otherPairsOf(const ResultRow& a, const ResultRow& b) {
    const auto count = [](const ResultRow& row) {
        const auto found = row.find("pair_count");
        return found != row.end() && found->second.exact.is_number()
                   ? found->second.exact.get<double>()
                   : 0.0;
    };
    const double before = count(a), now = count(b);
    return before > 0 && before != now ? OtherPairs({before, now}) : OtherPairs();
}

/// Returns whether a key counts wrong pairs.
bool countsWrongPairs(const std::string& key) {
    constexpr const char* kKeys[] = {"false_shadow_count",
                                     "false_light_count",
                                     "unexplained_false_shadow_count",
                                     "unexplained_false_light_count",
                                     "acne_count",
                                     "contact_count",
                                     "magnified_count",
                                     "wrong_count"};
    return std::find(std::begin(kKeys), std::end(kKeys), key) != std::end(kKeys);
}

/// Returns a change of a value, null where there is none.
/// @param pairs counts of wrong pairs are then better or worse by their share
Json changeOf(const std::string& path, const ResultValue& a, const ResultValue& b,
              const OtherPairs& pairs) {
    const std::string key = path.substr(path.rfind('.') + 1);
    if (a.names && b.names)
        return changeOfNames(path, *a.names, *b.names);
    if (a.measured && b.measured) {
        const QuantileInterval &x = *a.measured, &y = *b.measured;
        if (x.low <= y.high && y.low <= x.high)
            return {};
        return {{"key", path},
                {"a", x.value},
                {"b", y.value},
                {"a_interval", toJson(x)},
                {"b_interval", toJson(y)},
                {"verdict", x.isWide() && y.isWide()
                                ? verdictOf(y.value > x.value, directionOf(key))
                                : "uncertain"}};
    }
    const bool isOfPairs = pairs && countsWrongPairs(key) && a.exact.is_number() &&
                           b.exact.is_number() && (a.exact != 0 || b.exact != 0);
    if (a.measured || b.measured || (a.exact == b.exact && !isOfPairs))
        return {};
    const auto areSame = [](double x, double y) {
        return std::fabs(x - y) <= kLeastChange * std::max(std::fabs(x), std::fabs(y));
    };
    Json change = {{"key", path}, {"a", a.exact}, {"b", b.exact}, {"verdict", "changed"}};
    if (a.exact.is_boolean() && b.exact.is_boolean()) {
        if (key == "holds" || key == "agrees" || key == "ok")
            change["verdict"] = b.exact.get<bool>() ? "better" : "worse";
    } else if (a.exact.is_number() && b.exact.is_number()) {
        const double x = a.exact, y = b.exact;
        const bool areCounts = a.exact.is_number_integer() && b.exact.is_number_integer();
        if (!areCounts && areSame(x, y))
            return {};
        change["verdict"] = verdictOf(y > x, directionOf(key));
        if (key == "pair_count" && y == 0) // nothing was measured
            change["verdict"] = "worse";
        if (isOfPairs) {
            const double before = x / pairs->first, now = y / pairs->second;
            const bool isUnknown = pairs->second == 0; // of no pairs none can be wrong
            change["verdict"] = isUnknown || areSame(before, now)
                                    ? "changed"
                                    : verdictOf(now > before, directionOf(key));
            change["pair_counts"] = {uint64_t(pairs->first), uint64_t(pairs->second)};
        }
    }
    return change;
}

void refuse(bool isAllowed, const std::string& what, const std::string& difference,
            const std::string& files, Json& differences) {
    if (difference.empty())
        return;
    if (!isAllowed)
        throw Error(ErrorKind::kUsage, files + ": are of different " + what + "s: " + difference +
                                           "; compare results of one " + what +
                                           ", or allow it with "
                                           "--allow " +
                                           what);
    differences.push_back("the " + what + " differs: " + difference);
}

/// Returns the differences that are allowed, as texts. Throws Error kUsage for the others.
Json checkedDifferences(const std::string& files, const ResultsIdentity& a,
                        const ResultsIdentity& b, const DiffOptions& options) {
    if (a.kind != b.kind)
        throw Error(ErrorKind::kUsage, files + ": one is a result of " + a.kind +
                                           ", the other of " + b.kind +
                                           "; compare two results of one command");
    Json differences = Json::array();
    refuse(options.allowsScene, "scene", firstOtherScene(a, b), files, differences);
    refuse(options.allowsExperiment, "experiment", differenceText(a.experiment, b.experiment),
           files, differences);
    if (options.comparesTimes) {
        Json one = a.machine, other = b.machine;
        for (Json* const machine : {&one, &other}) // of which older results say nothing
            if (!a.machine.contains(kVectorInstructions) ||
                !b.machine.contains(kVectorInstructions))
                machine->erase(kVectorInstructions);
        refuse(options.allowsMachine, "machine", differenceText(one, other), files, differences);
    }
    for (const auto& [key, value] : a.program.items())
        if (b.program.value(key, Json()) != value)
            differences.push_back(key + " was " + jsonLine(value) + " and is " +
                                  jsonLine(b.program.value(key, Json())));
    return differences;
}

} // namespace

Json diffResults(const std::string& nameA, const Json& a, const std::string& nameB, const Json& b,
                 const DiffOptions& options) {
    ResultsIdentity ofA = identityOf(a), ofB = identityOf(b);
    if (!options.comparesTimes) {
        leaveOutRounds(ofA);
        leaveOutRounds(ofB);
    }
    for (const auto& [name, of] : {std::pair(nameA, &a), std::pair(nameB, &b)})
        if (of->is_object() && of->contains("part_count"))
            throw Error(ErrorKind::kInput, name +
                                               ": is a part of a compare; make the report of all "
                                               "parts by compare --join, and compare that");
    for (const auto& [name, kind] : {std::pair(nameA, ofA.kind), std::pair(nameB, ofB.kind)})
        if (kind.empty())
            throw Error(ErrorKind::kInput, name +
                                               ": is no result of compare, study, validate, bench, "
                                               "rays, calibrate or a record of the tests; give the "
                                               "JSON file that one of them wrote");
    Json diff = {{"a", nameA},
                 {"b", nameB},
                 {"differences", checkedDifferences(nameA + " and " + nameB, ofA, ofB, options)},
                 {"changes", Json::array()},
                 {"only_in_a", Json::array()},
                 {"only_in_b", Json::array()},
                 {"values_only_in_a", Json::array()}};
    const ResultRows rowsA = readRows(nameA, ofA.kind, options.comparesTimes, a);
    const ResultRows rowsB = readRows(nameB, ofB.kind, options.comparesTimes, b);
    std::map<std::string, uint64_t> counts;
    uint64_t rowCount = 0, valueCount = 0;
    static const std::map<std::string, ResultRow> kNoRows;
    const auto listOf = [](const ResultRows& rows,
                           const std::string& list) -> const std::map<std::string, ResultRow>& {
        const auto found = rows.find(list);
        return found == rows.end() ? kNoRows : found->second;
    };
    for (const auto& [list, rows] : rowsA) {
        const std::map<std::string, ResultRow>& others = listOf(rowsB, list);
        for (const auto& [name, row] : rows) {
            const auto other = others.find(name);
            if (other == others.end()) {
                diff["only_in_a"].push_back({{"list", list}, {"row", name}});
                continue;
            }
            ++rowCount;
            const OtherPairs pairs = otherPairsOf(row, other->second);
            for (const auto& [key, value] : row) {
                const auto found = other->second.find(key);
                if (found == other->second.end()) {
                    diff["values_only_in_a"].push_back(
                        {{"list", list}, {"row", name}, {"key", key}});
                    continue;
                }
                ++valueCount;
                Json change = changeOf(key, value, found->second, pairs);
                if (change.is_null())
                    continue;
                ++counts[change["verdict"]];
                Json entry = {{"list", list}, {"row", name}};
                entry.update(change);
                diff["changes"].push_back(std::move(entry));
            }
        }
    }
    for (const auto& [list, rows] : rowsB)
        for (const auto& [name, row] : rows)
            if (!listOf(rowsA, list).contains(name))
                diff["only_in_b"].push_back({{"list", list}, {"row", name}});
    diff["row_count"] = rowCount;
    diff["value_count"] = valueCount;
    for (const char* verdict : {"worse", "better", "changed", "uncertain"})
        diff[std::string(verdict) + "_count"] = counts[verdict];
    diff["lost_row_count"] = options.allowsExperiment ? 0 : diff["only_in_a"].size();
    diff["lost_value_count"] = options.allowsExperiment ? 0 : diff["values_only_in_a"].size();
    return diff;
}

std::string diffText(const Json& diff) {
    std::string text;
    for (const Json& difference : diff.at("differences"))
        text += difference.get<std::string>() + "\n";
    const auto number = [](const Json& value) {
        if (!value.is_number_float())
            return jsonLine(value);
        char digits[32];
        std::snprintf(digits, sizeof digits, "%.6g", value.get<double>());
        return std::string(digits);
    };
    const auto withInterval = [&](const Json& change, const std::string& side) {
        const std::string key = side + "_interval";
        return number(change[side]) +
               (change.contains(key)
                    ? " (" + number(change[key][0]) + " to " + number(change[key][1]) + ")"
                    : "");
    };
    const auto ofPairs = [](const Json& change, size_t side) {
        return change.contains("pair_counts")
                   ? " of " + jsonLine(change["pair_counts"][side]) + " pairs"
                   : std::string();
    };
    const auto named = [](const Json& change, const char* key) {
        std::string names;
        for (const Json& name : change.value(key, Json::array()))
            names += (names.empty() ? std::string("; ") + key + ": " : std::string("; ")) +
                     name.get<std::string>();
        return names;
    };
    for (const char* verdict : {"worse", "uncertain", "better", "changed"})
        for (const Json& change : diff.at("changes"))
            if (change["verdict"] == verdict)
                text += std::string(verdict) + ": " + change["list"].get<std::string>() + ", " +
                        change["row"].get<std::string>() + ": " + change["key"].get<std::string>() +
                        " " + withInterval(change, "a") + ofPairs(change, 0) + " -> " +
                        withInterval(change, "b") + ofPairs(change, 1) + named(change, "lost") +
                        named(change, "gained") + "\n";
    for (const auto& [key, name] :
         {std::pair("only_in_a", diff.at("a")), std::pair("only_in_b", diff.at("b"))})
        for (const Json& row : diff.at(key))
            text += "only in " + name.get<std::string>() + ": " + row["list"].get<std::string>() +
                    ", " + row["row"].get<std::string>() + "\n";
    for (const Json& value : diff.at("values_only_in_a"))
        text += "only in " + diff.at("a").get<std::string>() + ": " +
                value["list"].get<std::string>() + ", " + value["row"].get<std::string>() + ": " +
                value["key"].get<std::string>() + "\n";
    const auto count = [&](const char* key) { return diff.at(key).dump(); };
    text += countText(diff.at("value_count"), "value") + " of " +
            countText(diff.at("row_count"), "row") + ": " + count("worse_count") + " worse, " +
            count("better_count") + " better, " + count("changed_count") + " changed otherwise, " +
            count("uncertain_count") + " beyond intervals that hold less than 95 %\n";
    return text;
}

} // namespace shadowdag
