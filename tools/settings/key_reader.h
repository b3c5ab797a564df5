// SPDX-License-Identifier: Apache-2.0
// Reads a JSON object key by key, so that every invalid value is refused by name.
#pragma once

#include "cuda/error.h"
#include "tools/settings/json_file.h"
#include "tools/settings/parse.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace shadowdag {

/// Takes keys out of a JSON object, checks their type and value, and refuses unknown ones. An
/// absent key leaves its value unchanged. Throws Error kInput, beginning with `where`.
class KeyReader {
public:
    KeyReader(const Json& json, std::string where) : json_(json), where_(std::move(where)) {
        if (!json.is_object())
            throw Error(ErrorKind::kInput, where_ + ": must contain one JSON object");
    }

    void text(const char* key, std::string& value) {
        if (const Json* found = find(key)) {
            if (!found->is_string())
                refuse(key, *found, "must be a text");
            value = found->get<std::string>();
        }
    }
    void texts(const char* key, std::vector<std::string>& values) {
        if (const Json* found = find(key)) {
            values.clear();
            requireList(key, *found);
            for (const Json& item : *found) {
                if (!item.is_string())
                    refuse(key, item, "must be a list of texts");
                values.push_back(item.get<std::string>());
            }
        }
    }
    void flag(const char* key, bool& value) {
        if (const Json* found = find(key)) {
            if (!found->is_boolean())
                refuse(key, *found, "must be true or false");
            value = found->get<bool>();
        }
    }
    template <class T> void number(const char* key, T& value, double min, double max) {
        if (const Json* found = find(key))
            value = read<T>(key, *found, min, max);
    }
    template <class T>
    void numbers(const char* key, std::vector<T>& values, double min, double max,
                 bool mayBeEmpty = false) {
        if (const Json* found = find(key)) {
            values.clear();
            requireList(key, *found);
            for (const Json& item : *found) {
                values.push_back(read<T>(key, item, min, max));
                if (std::count(values.begin(), values.end(), values.back()) > 1)
                    refuse(key, item, "is listed twice; list each value once");
            }
            if (values.empty() && !mayBeEmpty)
                refuse(key, *found, "must contain at least one value");
        }
    }
    [[noreturn]] void refuse(const char* key, const Json& value, const std::string& right) const {
        throw Error(ErrorKind::kInput,
                    where_ + ": key \"" + key + "\" is " + jsonLine(value) + "; it " + right);
    }
    void finish() const {
        for (const auto& [key, value] : json_.items())
            if (!known_.contains(key)) {
                std::string all;
                for (const std::string& name : known_)
                    all += (all.empty() ? "" : ", ") + name;
                throw Error(ErrorKind::kInput,
                            where_ + ": unknown key \"" + key + "\"; the keys are " + all);
            }
    }
    const Json* find(const char* key) {
        known_.insert(key);
        const auto found = json_.find(key);
        return found == json_.end() ? nullptr : &*found;
    }
    void requireList(const char* key, const Json& value) const {
        if (!value.is_array())
            refuse(key, value, "must be a list");
    }

private:
    template <class T> T read(const char* key, const Json& value, double min, double max) const {
        const bool isWhole = !std::is_floating_point_v<T>;
        if (!(isWhole ? value.is_number_integer() : value.is_number()) ||
            value.get<double>() < min || value.get<double>() > max)
            refuse(key, value,
                   std::string("must be a ") + (isWhole ? "whole " : "") + "number from " +
                       numberText(min) + " to " + numberText(max));
        return value.get<T>();
    }

    const Json& json_;
    std::string where_;
    std::set<std::string> known_;
};

} // namespace shadowdag
