// SPDX-License-Identifier: Apache-2.0
// The extension module shadowdag._native: the library and the workspace for Python. The package
// shadowdag, in Python, is what users import.
#include "cuda/backend.h"
#include "python/call.h"
#include "python/callable_model.h"
#include "python/dag_object.h"
#include "python/errors.h"
#include "python/frame_object.h"
#include "python/scene_object.h"
#include "scenes/scene_folder.h"
#include "tools/settings/common_options.h"
#include "tools/settings/parse.h"
#include "tools/settings/provenance.h"

PYBIND11_MODULE(_native, scope) {
    using namespace shadowdag;
    using namespace shadowdag::python;
    scope.doc() = "The library of ShadowDAG; import shadowdag instead.";
    addErrors(scope);
    addMapRows();
    addDag(scope);
    addScene(scope);
    addFrame(scope);
    pollCalls();
    const auto setThreads = [](int64_t count) {
        setThreadCount(int(parseInteger("count", std::to_string(count), 0, kMaxThreadCount)));
    };
    scope.def("set_threads", setThreads, py::arg("count"),
              "Limits the library to this many CPU threads; 0: all cores. Changes no result.");
    scope.def("threads", &threadCount, "Returns the number of CPU threads.");
    scope.def("allow_outside", &allowOutsideFiles, py::arg("is_allowed"),
              "Sets whether scenes may name files outside of their own folder.");
    scope.def("built_with_cuda", &builtWithCuda, "Returns whether the module has CUDA passes.");
    scope.attr("__version__") = programVersion();
    scope.attr("__commit__") = programCommit();
}
