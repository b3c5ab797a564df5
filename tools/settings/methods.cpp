// SPDX-License-Identifier: Apache-2.0
// The registry of methods.
#include "tools/settings/method.h"

#include <stdexcept>

namespace shadowdag {

const Method& truthMethod();
const Method& embreeMethod();
const Method& dagMethod();
const Method& mapsMethod();
const Method& hybridMethod();

const std::vector<const Method*>& methods() {
    static const std::vector<const Method*> kMethods{&truthMethod(), &dagMethod(), &mapsMethod(),
                                                     &hybridMethod(), &embreeMethod()};
    return kMethods;
}

const Method* findMethod(const std::string& name) {
    for (const Method* method : methods())
        if (method->name() == name)
            return method;
    return nullptr;
}

const Method& methodOf(const std::string& name) {
    const Method* method = findMethod(name);
    if (method == nullptr)
        throw std::logic_error("'" + name + "' is not a method");
    return *method;
}

const std::vector<std::string>& methodNames() {
    static const std::vector<std::string> kNames = [] {
        std::vector<std::string> names;
        for (const Method* method : methods())
            names.push_back(method->name());
        return names;
    }();
    return kNames;
}

const std::vector<std::string>& measuredMethodNames() {
    static const std::vector<std::string> kNames = [] {
        std::vector<std::string> names;
        for (const Method* method : methods())
            if (!method->isTruth())
                names.push_back(method->name());
        return names;
    }();
    return kNames;
}

std::string joinedNames(const std::vector<std::string>& names) {
    std::string joined;
    for (const std::string& name : names)
        joined += (joined.empty() ? "" : ", ") + name;
    return joined;
}

} // namespace shadowdag
