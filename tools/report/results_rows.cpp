// SPDX-License-Identifier: Apache-2.0
#include "tools/report/results_rows.h"

#include "cuda/error.h"
#include "tools/settings/json_file.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <span>
#include <string_view>
#include <utility>

namespace shadowdag {

ResultDirection directionOf(const std::string& key) {
    const auto has = [&](const char* text) { return key.find(text) != std::string::npos; };
    for (const char* text : {"megarays_per_s", "ours_over_it", "embree_over_it"})
        if (has(text))
            return ResultDirection::kMoreIsBetter;
    // Of the results that are asked, and of the truth's own changes, none is an error.
    for (const char* text : {"settled", "answer_count", "point_count", "truth_change", "unanswered",
                             "null_sample", "allowed", "tolerance"})
        if (has(text))
            return ResultDirection::kNeither;
    for (const char* text :
         {"false_shadow", "false_light",  "unexplained", "unnamed",    "acne",         "contact",
          "magnified",    "missing_tap",  "flicker",     "error",      "rmse",         "flip",
          "wrong",        "lost_count",   "too_far",     "mismatch",   "disagreement", "null_rate",
          "differ",       "failed",       "ended_count", "lit_texels", "bytes",        "time_ms",
          "time_over",    "cpu_s",        "ns_per_pair", "regret",     "hidden",       "misplaced",
          "coarser",      "beyond_belief"})
        if (has(text))
            return ResultDirection::kLessIsBetter;
    return ResultDirection::kNeither;
}

namespace {

/// The keys that name a row, those of them that it has.
constexpr const char* kNameKeys[] = {"part",   "scene",  "failure",
                                     "row",    "name",   "group",
                                     "case",   "kind",   "asked_triangle_count",
                                     "frame",  "label",  "method",
                                     "remedy", "light",  "measure",
                                     "band",   "tracer", "order",
                                     "call",   "camera"};
/// Further keys that name a row, by the kind of results. They are values in other kinds.
constexpr std::pair<const char*, const char*> kNameKeysOfKind[] = {
    {"calibrate", "view"},      {"determinism", "system"},    {"determinism", "compiler"},
    {"determinism", "backend"}, {"determinism", "isa"},       {"determinism", "threads"},
    {"determinism", "device"},  {"determinism", "what"},      {"determinism", "program"},
    {"filters", "shape"},       {"filters", "angle_degrees"}, {"filters", "face_texels"},
    {"filters", "bias_texels"}, {"filters", "taps"},          {"gpu_check", "step"},
    {"gpu_check", "backend"},   {"gpu_check", "resolution"},  {"gpu_check", "size"},
    {"gpu_check", "kernel"},    {"layouts", "resolution"},    {"layouts", "variant"},
    {"bench module", "size"}};
/// Kinds whose numbers are times and what follows from times, but for their counts.
constexpr const char* kKindsOfTimes[] = {"calibrate", "regret"};
/// Kinds that are an object of rows by name.
constexpr const char* kKindsOfNamedRows[] = {"faults", "fuzzing"};
/// Lists of rows that belong to a row: the scenes of a mechanism, the frames of a regret.
constexpr const char* kInnerLists[] = {"scenes", "frames", "rates", "kernels", "methods"};
/// Lists that hold no results, or costs without a spread.
constexpr const char* kOtherLists[] = {"scenes",   "map_costs",     "truth_images",
                                       "pictures", "broken",        "warnings",
                                       "left_out", "disagreements", "crossovers"};
/// Members that are lists of objects.
constexpr const char* kLists[] = {"runs",    "sequence_runs", "cells",   "checks",
                                  "mutants", "mechanisms",    "numeric", "perturbation",
                                  "rates",   "verdicts",      "lights",  "sequence_times"};
/// Keys of a row that are names, settings and bounds of it, or show its picture.
constexpr const char* kOtherKeys[] = {
    "parameters", "images",  "image",      "bounds",     "broken",         "unknown",
    "settings",   "what",    "source",     "model",      "camera_numbers", "visibility_histogram",
    "pool_note",  "known",   "provenance", "experiment", "study",          "inputs",
    "harmless",   "is_used", "verdict",    "shown_as",   "about",          "calibration",
    "fit",        "device"};

/// Returns whether a member of one of these lists' names has its type: `checks` of a bench is one
/// object, and `lights` of some results are those that were asked for.
bool isListLike(const std::string& key, const Json& value) {
    return value.is_array() || key == "lights" || (key == "checks" && value.is_object());
}

bool isListed(const char* const* begin, const char* const* end, const std::string& key) {
    return std::find(begin, end, key) != end;
}

/// Returns whether a key names a row of results of a kind.
bool isNameKey(const std::string& kind, const std::string& key) {
    return isListed(std::begin(kNameKeys), std::end(kNameKeys), key) ||
           std::any_of(std::begin(kNameKeysOfKind), std::end(kNameKeysOfKind),
                       [&](const auto& of) { return kind == of.first && key == of.second; });
}

bool endsWith(const std::string& text, std::string_view end) {
    return text.size() >= end.size() &&
           text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/// Returns whether a value is a time, a rate or a share of a machine's time.
bool isOfTime(const std::string& key) {
    return endsWith(key, "_ms") || endsWith(key, "_s") || key == "ns" || key == "ns_each" ||
           endsWith(key, "cpu_share") || key.find("time_") != std::string::npos ||
           key.find("_per_s") != std::string::npos || key.find("_per_pair") != std::string::npos ||
           key.find("_over_it") != std::string::npos || endsWith(key, "time_ratio") ||
           key == "repeat_count" || key == "thread_count" || // of what is measured, not of answers
           key == "us" || key == "seconds" || endsWith(key, "_percent") || key == "active_lanes" ||
           key == "rate_ratio" || key == "texels_per_ray" || endsWith(key, "rss_bytes");
}

/// Returns whether a value can only be a number >= 0, or, if it is time_ms, a list of such.
bool isQuantity(const std::string& key) {
    for (const char* other : {"error_metric", "wrong_pairs", "unnamed", "round_times_ms"})
        if (key == other) // texts and lists
            return false;
    return !key.starts_with("is_") && (directionOf(key) != ResultDirection::kNeither ||
                                       isOfTime(key) || endsWith(key, "_count"));
}

/// Returns whether a value can be at most 1.
bool isShare(const std::string& key) {
    return endsWith(key, "_share") || endsWith(key, "_rate") || endsWith(key, "_confidence") ||
           key == "mean_abs_visibility_error" || key == "rmse" || key == "flip";
}

/// Throws Error kInput for a value that is not a number >= 0, for a count that is no whole one, and
/// for a share above 1.
/// @param where file and row, for the message
void checkNumber(const Json& value, const std::string& key, const std::string& where) {
    const auto refuse = [&](const char* must) {
        throw Error(ErrorKind::kInput, where + ": \"" + key + "\" is " + jsonLine(value) +
                                           "; it must be " + must + "; measure it again");
    };
    if (!value.is_number() || !(value.get<double>() >= 0))
        refuse("a number >= 0");
    if (endsWith(key, "_count") && value.get<double>() != std::floor(value.get<double>()))
        refuse("a whole number");
    if (isShare(key) && value.get<double>() > 1)
        refuse("at most 1");
}

/// Throws Error kInput for a quantity of an object that is not a number >= 0, and for one outside
/// the interval beside it.
void checkQuantity(const Json& object, const std::string& key, const std::string& where) {
    checkNumber(object[key], key, where);
    for (const auto& [low, high] : {std::pair("_low", "_high"), std::pair("_min", "_max")}) {
        const std::string ends[] = {key + low, key + high};
        for (const std::string& end : {ends[0], ends[1], key + "_confidence"})
            if (object.contains(end))
                checkNumber(object[end], end, where);
        if (object.contains(ends[0]) && object.contains(ends[1]) &&
            !(object[ends[0]] <= object[key] && object[key] <= object[ends[1]]))
            throw Error(ErrorKind::kInput, where + ": \"" + key + "\" is " + jsonLine(object[key]) +
                                               ", outside its interval, " +
                                               jsonLine(object[ends[0]]) + " to " +
                                               jsonLine(object[ends[1]]) + "; measure it again");
    }
}

/// Returns the checks that notice a fault, each with the row, the method and the remedy of which it
/// does.
std::set<std::string> noticesOf(const Json& notices, const std::string& where) {
    std::set<std::string> names;
    for (const Json& notice : notices) {
        if (!notice.is_object())
            throw Error(ErrorKind::kInput, where + ": \"notices\" holds " + jsonLine(notice) +
                                               "; it must be a list of objects; measure it again");
        std::string name;
        for (const char* key : {"check", "row", "method", "remedy"})
            if (const auto found = notice.find(key); found != notice.end() && *found != "")
                name += (name.empty() ? "" : ", ") +
                        (found->is_string() ? found->get<std::string>() : jsonLine(*found));
        names.insert(name);
    }
    return names;
}

std::optional<double> numberIn(const Json& object, const std::string& key) {
    const auto found = object.find(key);
    if (found == object.end() || !found->is_number())
        return {};
    return found->get<double>();
}

/// Returns the interval that stands beside a value. Of n values that are known by their least and
/// greatest alone, these hold the median with 1 - 2^(1 - n).
std::optional<QuantileInterval> intervalBeside(const Json& object, const std::string& key) {
    const auto value = numberIn(object, key);
    if (!value)
        return {};
    if (const auto low = numberIn(object, key + "_low"), high = numberIn(object, key + "_high");
        low && high)
        return QuantileInterval{*value, *low, *high,
                                numberIn(object, key + "_confidence").value_or(0)};
    if (const auto low = numberIn(object, key + "_min"), high = numberIn(object, key + "_max");
        low && high)
        return QuantileInterval{
            *value, *low, *high,
            1.0 - std::exp2(1.0 - std::max(numberIn(object, "repeat_count").value_or(1), 1.0))};
    return {};
}

/// Reads the rows of results.
class RowReader {
public:
    RowReader(std::string file, std::string kind, bool readsTimes)
        : file_(std::move(file)), kind_(std::move(kind)), readsTimes_(readsTimes) {}

    ResultRows read(const Json& results) {
        Json self = Json::object();
        for (const auto& [key, value] : results.items())
            if (isKindIn(kKindsOfNamedRows) && value.is_object())
                addRow("rows", key, value);
            else if (!value.is_array())
                self[key] = value;
        addRow("results", "all", self);
        addInnerLists("results", self, "");
        for (const auto& names :
             {std::span<const char* const>(kLists), std::span<const char* const>(kOtherLists)})
            for (const char* list : names)
                if (results.contains(list) && !isListLike(list, results[list]))
                    throw Error(ErrorKind::kInput, file_ + ": \"" + list + "\" is " +
                                                       jsonLine(results[list]) +
                                                       "; it must be a list; measure it again");
        for (const auto& [list, rows] : results.items())
            if (rows.is_array() && !isListed(std::begin(kOtherKeys), std::end(kOtherKeys), list) &&
                (!isListed(std::begin(kOtherLists), std::end(kOtherLists), list) ||
                 (kind_ == "regret" && list == "scenes")))
                addList(list, rows, "");
        return std::move(rows_);
    }

private:
    void addList(const std::string& list, const Json& rows, const std::string& prefix) {
        for (const Json& row : rows) {
            if (isListed(std::begin(kLists), std::end(kLists), list) && !row.is_object())
                throw Error(ErrorKind::kInput,
                            file_ + ": \"" + list + "\" holds " + jsonLine(row) +
                                "; it must be a list of objects; measure it again");
            if (!row.is_object())
                return; // a list of values belongs to its row
            const std::string name = prefix + nameOf(row);
            addRow(list, name, row);
            addInnerLists(list, row, name + ", ");
        }
    }

    /// Adds the lists of rows that a row, or an object of it, holds.
    void addInnerLists(const std::string& list, const Json& row, const std::string& prefix) {
        for (const auto& [key, value] : row.items())
            if (value.is_array() && isListed(std::begin(kInnerLists), std::end(kInnerLists), key))
                addList(list, value, prefix);
            else if (value.is_object() &&
                     !isListed(std::begin(kOtherKeys), std::end(kOtherKeys), key))
                addInnerLists(list, value, prefix + key + ", ");
    }

    std::string nameOf(const Json& row) const {
        std::string name;
        const auto add = [&](const char* key) {
            const auto found = row.find(key);
            if (found == row.end() || found->is_object() || found->is_array())
                return;
            name += name.empty() ? "" : ", ";
            name += found->is_string() ? found->get<std::string>()
                                       : std::string(key) + " " + jsonLine(*found);
        };
        for (const char* key : kNameKeys)
            add(key);
        for (const auto& [kind, key] : kNameKeysOfKind)
            if (kind_ == kind)
                add(key);
        return name;
    }

    template <size_t N> bool isKindIn(const char* const (&kinds)[N]) const {
        return isListed(std::begin(kinds), std::end(kinds), kind_);
    }

    void addRow(const std::string& list, const std::string& name, const Json& object) {
        ResultRow row;
        const std::string where = file_ + ": \"" + list + "\", row '" + name + "'";
        addValues(object, "", row, false, where);
        checkPairs(object, where);
        if (!rows_[list].emplace(name, std::move(row)).second)
            throw Error(ErrorKind::kInput, file_ + ": \"" + list + "\" has two rows '" + name +
                                               "', so that neither can be compared; measure it "
                                               "again");
    }

    /// @param isOfTimes whether the object is of times, as stages_ms is
    /// @param where file and row, for messages
    void addValues(const Json& object, const std::string& prefix, ResultRow& row, bool isOfTimes,
                   const std::string& where) const {
        for (const auto& [key, value] : object.items()) {
            if ((isNameKey(kind_, key) && !value.is_object()) ||
                isListed(std::begin(kOtherKeys), std::end(kOtherKeys), key) ||
                isBesideAnother(object, key))
                continue;
            if (key == "other_cpu_share" && value.is_null())
                continue; // not known
            if (key == "regret" && value.is_object()) {
                addRegrets(value, object.value("regret_intervals", Json::object()), row, where);
                continue;
            }
            if (isKindIn(kKindsOfTimes) && !value.is_object() && !endsWith(key, "_count"))
                continue;
            if ((key == "stages_ms" && !value.is_object()) ||
                (key == "round_times_ms" && !value.is_array()))
                throw Error(ErrorKind::kInput, where + ": \"" + key + "\" is " + jsonLine(value) +
                                                   "; it must be " +
                                                   (key == "stages_ms" ? "an object" : "a list") +
                                                   " of times; measure it again");
            if (value.is_object()) {
                addValues(value, prefix + key + ".", row, isOfTimes || isOfTime(key), where);
                continue;
            }
            const bool isListOfTimes =
                key == "round_times_ms" || (key == "time_ms" && value.is_array() && !value.empty());
            if ((isOfTimes || isQuantity(key)) && !isListOfTimes)
                checkQuantity(object, key, where);
            if (key == "notices") { // of a fault: which checks noticed it
                row[object.value("name", "") == "none" ? "noticed without a fault" : "noticed by"] =
                    {{}, {}, noticesOf(value, where)};
            } else if (isListOfTimes) {
                for (const Json& time : value)
                    checkNumber(time, key, where);
                if (readsTimes_ && key == "time_ms")
                    row[prefix + key] = {{}, medianInterval(value.get<std::vector<double>>()), {}};
            } else if (!value.is_array() && (isOfTimes || isOfTime(key))) {
                if (const auto interval = intervalBeside(object, key); interval && readsTimes_)
                    row[prefix + key] = {{}, interval, {}};
            } else if (!value.is_array()) {
                row[prefix + key] = {value, {}, {}};
            }
        }
    }

    /// Throws Error kInput where more pairs are dark, or wrong, than there are.
    static void checkPairs(const Json& object, const std::string& where) {
        const auto pairs = numberIn(object, "pair_count");
        if (!pairs)
            return;
        const auto count = [&](const char* key) { return numberIn(object, key).value_or(0); };
        const double dark = count("occluded_count"),
                     wrong = count("false_shadow_count") + count("false_light_count");
        for (const auto& [what, value] : {std::pair("dark", dark), std::pair("wrong", wrong)})
            if (value > *pairs) {
                char counts[80];
                std::snprintf(counts, sizeof counts, ": %.10g of %.10g pairs are ", value, *pairs);
                throw Error(ErrorKind::kInput, where + counts + what + "; measure it again");
            }
    }

    /// Adds the losses of models against the oracle, of which `intervals` has the ends.
    void addRegrets(const Json& regrets, const Json& intervals, ResultRow& row,
                    const std::string& where) const {
        for (const auto& [model, regret] : regrets.items()) {
            const Json ends = intervals.value(model, Json());
            if (!regret.is_number() || !ends.is_array() || ends.size() != 2 ||
                !ends[0].is_number() || !ends[1].is_number())
                throw Error(ErrorKind::kInput, where + ": the regret of '" + model + "' is " +
                                                   jsonLine(regret) + " with the interval " +
                                                   jsonLine(ends) +
                                                   "; both must be numbers; measure it again");
            if (readsTimes_)
                row["regret " + model] = {
                    {}, QuantileInterval{regret, ends[0], ends[1], kConfidence}, {}};
        }
    }

    /// Returns whether a value is an end of another's interval or its confidence.
    static bool isBesideAnother(const Json& object, const std::string& key) {
        for (const char* end : {"_low", "_high", "_min", "_max", "_confidence"})
            if (endsWith(key, end) &&
                object.contains(key.substr(0, key.size() - std::string_view(end).size())))
                return true;
        return false;
    }

    std::string file_, kind_;
    bool readsTimes_;
    ResultRows rows_;
};

} // namespace

ResultRows readRows(const std::string& file, const std::string& kind, bool readsTimes,
                    const Json& results) {
    return RowReader(file, kind, readsTimes).read(results);
}

} // namespace shadowdag
