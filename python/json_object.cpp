// SPDX-License-Identifier: Apache-2.0
#include "python/json_object.h"

#include "cuda/error.h"
#include "python/errors.h"
#include "tools/settings/json_file.h"

#include <nlohmann/json.hpp>

#include <cmath>

namespace shadowdag::python {

namespace py = pybind11;

py::object toPython(const Json& value) {
    switch (value.type()) {
    case Json::value_t::object: {
        py::dict dict;
        for (const auto& [key, member] : value.items())
            dict[textObject(key)] = toPython(member);
        return dict;
    }
    case Json::value_t::array: {
        py::list list;
        for (const Json& member : value)
            list.append(toPython(member));
        return list;
    }
    case Json::value_t::string:
        return textObject(value.get<std::string>());
    case Json::value_t::boolean:
        return py::bool_(value.get<bool>());
    case Json::value_t::number_unsigned:
        return py::int_(value.get<uint64_t>());
    case Json::value_t::number_integer:
        return py::int_(value.get<int64_t>());
    case Json::value_t::number_float:
        return py::float_(value.get<double>());
    default:
        return py::none();
    }
}

namespace {

[[noreturn]] void refuse(const py::handle& value, const std::string& where, const char* what) {
    throw Error(ErrorKind::kUsage, where + ": " + std::string(py::repr(value)) + " " + what);
}

std::string textOf(const py::handle& value, const std::string& where) {
    py::ssize_t size = 0;
    const char* const bytes = PyUnicode_AsUTF8AndSize(value.ptr(), &size);
    if (bytes == nullptr) { // a half of a surrogate pair
        PyErr_Clear();
        refuse(value, where, "is no text that UTF-8 can write");
    }
    std::string text(bytes, size_t(size));
    refuseZeroByte(text);
    return text;
}

/// @param depth of lists and dicts around the value
Json jsonAt(const py::handle& value, const std::string& where, int depth) {
    if (depth > kMaxJsonDepth)
        throw Error(ErrorKind::kUsage, where + ": nests deeper than " +
                                           std::to_string(kMaxJsonDepth) +
                                           " levels, or contains itself");
    if (value.is_none())
        return nullptr;
    if (py::isinstance<py::bool_>(value))
        return value.cast<bool>();
    if (py::isinstance<py::int_>(value)) {
        int isBeyond = 0;
        const long long number = PyLong_AsLongLongAndOverflow(value.ptr(), &isBeyond);
        if (isBeyond != 0)
            refuse(value, where, "is beyond 64 bits");
        return int64_t(number);
    }
    if (py::isinstance<py::float_>(value)) {
        const double number = value.cast<double>();
        return std::isinf(number) && number > 0 ? Json("inf") : Json(number);
    }
    if (py::isinstance<py::str>(value))
        return textOf(value, where);
    if (py::isinstance<py::dict>(value)) {
        Json object = Json::object();
        for (const auto& [key, member] : py::reinterpret_borrow<py::dict>(value)) {
            if (!py::isinstance<py::str>(key))
                throw Error(ErrorKind::kUsage,
                            where + ": the key " + std::string(py::repr(key)) + " is not a text");
            object[textOf(key, where)] = jsonAt(member, where, depth + 1);
        }
        return object;
    }
    if (py::isinstance<py::list>(value) || py::isinstance<py::tuple>(value)) {
        Json list = Json::array();
        for (const py::handle& member : value)
            list.push_back(jsonAt(member, where, depth + 1));
        return list;
    }
    if (py::hasattr(value, "__fspath__"))
        return jsonAt(value.attr("__fspath__")(), where, depth + 1);
    if (py::hasattr(value, "tolist")) // numbers and arrays of numpy
        return jsonAt(value.attr("tolist")(), where, depth + 1);
    refuse(value, where, "is neither a number, a text, a list nor a dict");
}

} // namespace

Json jsonOf(const py::handle& value, const std::string& where) {
    return jsonAt(value, where, 0);
}

} // namespace shadowdag::python
