// SPDX-License-Identifier: Apache-2.0
#include "python/errors.h"

#include "cuda/error.h"
#include "scenes/printable.h"
#include "tools/commands/exit_message.h"
#include "tools/settings/console.h"

#include <map>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>

namespace shadowdag::python {

namespace py = pybind11;

namespace {

/// The classes by exit status; never released, because exceptions may outlive the scope.
std::map<int, PyObject*>& classes() {
    static std::map<int, PyObject*> byStatus;
    return byStatus;
}

PyObject* addClass(py::module_& scope, const char* name, const char* text, PyObject* first,
                   PyObject* second) {
    const py::tuple bases = second ? py::make_tuple(py::handle(first), py::handle(second))
                                   : py::make_tuple(py::handle(first));
    const std::string full = std::string("shadowdag.") + name;
    PyObject* made = PyErr_NewExceptionWithDoc(full.c_str(), text, bases.ptr(), nullptr);
    if (made == nullptr)
        throw py::error_already_set();
    scope.add_object(name, py::handle(made));
    return made;
}

void raise(const std::exception& exception) {
    const ExitMessage exit = exitMessageOf(exception);
    PyErr_SetObject(classes().at(exit.status), textObject(printable(exit.message)).ptr());
}

} // namespace

void refuseZeroByte(const std::string& argument) {
    if (argument.find('\0') != std::string::npos)
        throw Error(ErrorKind::kUsage, printable(argument) + ": contains a zero byte; drop it");
}

std::string pathOf(const py::object& path) {
    const py::object text = py::hasattr(path, "__fspath__") ? path.attr("__fspath__")() : path;
    if (!py::isinstance<py::str>(text))
        throw py::type_error("a path is " +
                             py::str(py::type::of(path).attr("__name__")).cast<std::string>() +
                             "; it must be str or os.PathLike");
    const auto bytes = py::reinterpret_steal<py::bytes>(PyUnicode_EncodeFSDefault(text.ptr()));
    if (!bytes)
        throw py::error_already_set();
    return bytes;
}

py::str textObject(const std::string& text) {
    auto object = py::reinterpret_steal<py::str>(
        PyUnicode_DecodeUTF8(text.data(), py::ssize_t(text.size()), "surrogateescape"));
    if (!object)
        throw py::error_already_set();
    return object;
}

void addErrors(py::module_& scope) {
    PyObject* const base = addClass(scope, "Error",
                                    "What the library refuses or cannot do: the base of the "
                                    "classes below. The message names the value and the remedy.",
                                    PyExc_Exception, nullptr);
    classes() = {
        {int(ErrorKind::kUsage),
         addClass(scope, "UsageError", "Contradictory or unknown settings and arguments.", base,
                  PyExc_ValueError)},
        {int(ErrorKind::kInput),
         addClass(scope, "InputError", "A bad input file or scene.", base, PyExc_ValueError)},
        {int(ErrorKind::kResource),
         addClass(scope, "ResourceError", "Not enough memory or disk.", base, PyExc_RuntimeError)},
        {int(ErrorKind::kDevice),
         addClass(scope, "DeviceError", "The requested device is missing or failed.", base,
                  PyExc_RuntimeError)},
        {kDefectExitStatus, addClass(scope, "DefectError", "A defect of shadowdag itself.", base,
                                     PyExc_RuntimeError)}};
    addClass(scope, "Warning", "Remarks of the library about a scene, an asset or a result.",
             PyExc_UserWarning, nullptr);
    py::register_exception_translator([](std::exception_ptr pointer) {
        try {
            std::rethrow_exception(pointer);
        } catch (const Error& error) {
            raise(error);
        } catch (const std::bad_alloc& error) {
            raise(error);
        } catch (const std::logic_error& error) {
            raise(error);
        } catch (const std::system_error& error) { // files, threads: with the program's remedies
            raise(error);
        } catch (const Interrupted&) {
            PyErr_SetNone(PyExc_KeyboardInterrupt);
        }
    });
}

} // namespace shadowdag::python
