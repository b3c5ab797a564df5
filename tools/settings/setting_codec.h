// SPDX-License-Identifier: Apache-2.0
// The types of values of settings, and functions that make rows of the table from them. Included by
// settings_table.cpp alone.
#pragma once

#include "cuda/error.h"
#include "tools/settings/parse.h"
#include "tools/settings/setting.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

namespace shadowdag {

/// One type of value: its text and its JSON.
template <class T> struct Codec {
    std::function<T(const std::string& name, const std::string& text)> parse; ///< as in parse.h
    std::function<std::string(const T&)> text;
    std::function<Json(const T&)> json;
};

/// Returns a float as JSON writes it: 0.1 instead of 0.10000000149, infinity as "inf".
inline Json decimalJson(double value) {
    return std::isinf(value) ? Json("inf") : Json(std::stod(numberText(value)));
}

template <class T> Codec<T> numberCodec(double min, double max) {
    return {[=](const std::string& name, const std::string& text) {
                return T(parseNumber(name, text, min, max));
            },
            [](const T& value) { return numberText(double(value)); },
            [](const T& value) {
                if constexpr (std::is_same_v<T, double>)
                    return Json(value);
                else
                    return decimalJson(double(value));
            }};
}

template <class T> Codec<T> wholeCodec(int64_t min, int64_t max) {
    return {[=](const std::string& name, const std::string& text) {
                return T(parseInteger(name, text, min, max));
            },
            [](const T& value) { return std::to_string(value); },
            [](const T& value) { return Json(value); }};
}

/// Powers of two, stored as they are or as their log2.
inline Codec<uint32_t> powerCodec(uint32_t min, uint32_t max, bool isLog2) {
    const auto powerOf = [=](uint32_t value) { return isLog2 ? 1u << value : value; };
    return {[=](const std::string& name, const std::string& text) {
                const uint32_t log2 = parsePowerOfTwo(name, text, min, max);
                return isLog2 ? log2 : 1u << log2;
            },
            [=](const uint32_t& value) { return std::to_string(powerOf(value)); },
            [=](const uint32_t& value) { return Json(powerOf(value)); }};
}

inline Codec<std::string> textCodec() {
    return {[](const std::string&, const std::string& text) { return text; },
            [](const std::string& text) { return text; },
            [](const std::string& text) { return Json(text); }};
}

/// Makes the row of a field that holds one value.
template <class T> Setting oneValue(Setting row, T Experiment::*field, const Codec<T>& codec) {
    row.set = [=](Experiment& e, const std::string& name, const std::vector<std::string>& texts) {
        e.*field = codec.parse(name, texts.at(0));
    };
    row.texts = [=](const Experiment& e) { return std::vector<std::string>{codec.text(e.*field)}; };
    row.json = [=](const Experiment& e) { return codec.json(e.*field); };
    return row;
}

/// Makes the row of a field that holds a list. Duplicate values, in whatever spelling, are refused.
template <class T>
Setting listOf(Setting row, std::vector<T> Experiment::*field, const Codec<T>& codec) {
    const bool mayBeEmpty = row.mayBeEmpty;
    const bool isAlwaysList = row.isList;
    row.set = [=](Experiment& e, const std::string& name, const std::vector<std::string>& texts) {
        std::vector<T> values;
        for (const std::string& text : texts) {
            const T value = codec.parse(name, text);
            if (std::find(values.begin(), values.end(), value) != values.end())
                throw Error(ErrorKind::kUsage, name + " '" + text + "': " + codec.text(value) +
                                                   " is listed twice; list each value once");
            values.push_back(value);
        }
        if (values.empty() && !mayBeEmpty)
            throw Error(ErrorKind::kUsage, name + ": must contain at least one value");
        e.*field = std::move(values);
    };
    row.texts = [=](const Experiment& e) {
        std::vector<std::string> texts;
        for (const T& value : e.*field)
            texts.push_back(codec.text(value));
        return texts;
    };
    row.json = [=](const Experiment& e) {
        if (!isAlwaysList && (e.*field).size() == 1)
            return codec.json((e.*field)[0]);
        Json list = Json::array();
        for (const T& value : e.*field)
            list.push_back(codec.json(value));
        return list;
    };
    return row;
}

/// Makes the row of a list that frames follow, one value each.
/// @param get,set a frame's option
template <class T, class Get, class Set>
Setting frameValue(Setting row, std::vector<T> Experiment::*field, const Codec<T>& codec, Get get,
                   Set set) {
    row = listOf(std::move(row), field, codec);
    row.isVaried = true;
    row.apply = [=](const Experiment& e, size_t index, FrameOptions& frame) {
        set(frame, (e.*field)[index]);
    };
    row.setFrame = [=](FrameOptions& frame, const std::string& name, const std::string& text) {
        set(frame, codec.parse(name, text));
    };
    row.frameText = [=](const FrameOptions& frame) { return codec.text(get(frame)); };
    row.frameJson = [=](const FrameOptions& frame) { return codec.json(get(frame)); };
    return row;
}

} // namespace shadowdag
