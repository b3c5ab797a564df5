// SPDX-License-Identifier: Apache-2.0
#include "python/json_object.h"

#include "cuda/error.h"
#include "python/errors.h"

#include <nlohmann/json.hpp>

#include <cmath>

namespace shadowdag::python {

namespace py = pybind11;

py::object toPython(const Json& value) {
    switch (value.type()) {
    case Json::value_t::object: {
        py::dict dict;
        for (const auto& [key, member] : value.items())
            dict[py::str(key)] = toPython(member);
        return dict;
    }
    case Json::value_t::array: {
        py::list list;
        for (const Json& member : value)
            list.append(toPython(member));
        return list;
    }
    case Json::value_t::string:
        return py::str(value.get<std::string>());
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

Json jsonOf(const py::handle& value, const std::string& where) {
    if (value.is_none())
        return nullptr;
    if (py::isinstance<py::bool_>(value))
        return value.cast<bool>();
    if (py::isinstance<py::int_>(value))
        return value.cast<int64_t>();
    if (py::isinstance<py::float_>(value)) {
        const double number = value.cast<double>();
        return std::isinf(number) && number > 0 ? Json("inf") : Json(number);
    }
    if (py::isinstance<py::str>(value)) {
        const auto text = value.cast<std::string>();
        refuseZeroByte(text);
        return text;
    }
    if (py::isinstance<py::dict>(value)) {
        Json object = Json::object();
        for (const auto& [key, member] : py::reinterpret_borrow<py::dict>(value)) {
            if (!py::isinstance<py::str>(key))
                throw Error(ErrorKind::kUsage,
                            where + ": the key " + std::string(py::repr(key)) + " is not a text");
            object[key.cast<std::string>()] = jsonOf(member, where);
        }
        return object;
    }
    if (py::isinstance<py::list>(value) || py::isinstance<py::tuple>(value)) {
        Json list = Json::array();
        for (const py::handle& member : value)
            list.push_back(jsonOf(member, where));
        return list;
    }
    if (py::hasattr(value, "__fspath__"))
        return jsonOf(value.attr("__fspath__")(), where);
    if (py::hasattr(value, "tolist")) // numbers and arrays of numpy
        return jsonOf(value.attr("tolist")(), where);
    throw Error(ErrorKind::kUsage, where + ": " + std::string(py::repr(value)) +
                                       " is neither a number, a text, a list nor a dict");
}

} // namespace shadowdag::python
