// SPDX-License-Identifier: Apache-2.0
#include "python/callable_model.h"

#include "cuda/error.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

namespace shadowdag::python {

namespace py = pybind11;

/// A row of the array: MapQuantities, and what the frame did.
struct MapRow {
    uint32_t light, octave;
    float texels;
    uint32_t face_texels, pages;
    uint64_t samples;
    uint32_t clusters;
    uint64_t triangles;
    uint32_t batches, lights;
    float range;
    uint64_t pairs;
    uint32_t movers;
    float mover_crossings;
    uint8_t route;
    uint64_t pair_count;
};

namespace {

MapRow rowOf(const MapQuantities& q) {
    return {q.light,     q.octave,  q.texels, q.faceTexels, q.pages, q.samples, q.clusters,
            q.triangles, q.batches, q.lights, q.range,      q.pairs, q.movers,  q.moverCrossings,
            0,           0};
}

/// Returns the fields that counting one of kCountNames gives.
std::vector<std::string> fieldsOf(const std::string& counted) {
    if (counted == "triangles")
        return {"triangles", "batches"};
    if (counted == "movers")
        return {"movers", "mover_crossings"};
    return {counted};
}

/// The quantities alone, as a model sees them: those that are not counted are left out, so that
/// numpy refuses to read them.
py::array quantityRows(const std::vector<MapQuantities>& maps, uint32_t counts) {
    py::array_t<MapRow> rows(static_cast<py::ssize_t>(maps.size()));
    std::transform(maps.begin(), maps.end(), rows.mutable_data(), rowOf);
    std::vector<std::string> hidden{"route", "pair_count"};
    for (size_t i = 0; i < std::size(kCountNames); ++i)
        if ((counts >> i & 1) == 0)
            for (const std::string& field : fieldsOf(kCountNames[i]))
                hidden.push_back(field);
    py::list names;
    for (const py::handle& name : rows.dtype().attr("names"))
        if (std::find(hidden.begin(), hidden.end(), name.cast<std::string>()) == hidden.end())
            names.append(name);
    return rows.attr("__getitem__")(names);
}

uint32_t countsOf(const py::object& function) {
    if (!py::hasattr(function, "counts"))
        return kCountsAll;
    uint32_t counts = kCountsNothing;
    for (const py::handle& item : function.attr("counts")) {
        const std::string name = py::str(item);
        const auto* const found = std::find(std::begin(kCountNames), std::end(kCountNames), name);
        if (found == std::end(kCountNames)) {
            std::string known;
            for (const char* one : kCountNames)
                known += (known.empty() ? "" : ", ") + std::string(one);
            throw Error(ErrorKind::kUsage, "the cost model's counts: '" + name +
                                               "' is not counted; the names are " + known);
        }
        counts |= 1u << (found - std::begin(kCountNames));
    }
    return counts;
}

/// Owns a Python object that may be released without the interpreter's lock.
class Held {
public:
    explicit Held(py::object object) : object_(std::move(object)) {}
    ~Held() {
        const py::gil_scoped_acquire locked;
        object_ = py::object();
    }
    Held(const Held&) = delete;
    Held& operator=(const Held&) = delete;
    const py::object& operator*() const { return object_; }

private:
    py::object object_;
};

class CallableModel : public CostModel {
public:
    explicit CallableModel(const py::object& function)
        : counts_(countsOf(function)), function_(function) {}

    std::vector<double> weigh(const std::vector<MapQuantities>& maps) const override {
        const py::gil_scoped_acquire locked;
        const py::object result = (*function_)(quantityRows(maps, counts_));
        const py::array array = py::module_::import("numpy").attr("asarray")(result);
        const std::string kind = py::str(array.dtype().attr("kind"));
        if (array.ndim() != 1 || size_t(array.shape(0)) != maps.size() ||
            std::string("bfiu").find(kind) == std::string::npos)
            throw Error(ErrorKind::kUsage,
                        "the cost model returned " + std::string(py::str(array.dtype())) +
                            " of the shape " + std::string(py::str(array.attr("shape"))) +
                            "; it must return one bool (True: rays) or number (cost of the map "
                            "over that of its rays) for each of the " +
                            std::to_string(maps.size()) + " maps");
        const auto values =
            py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(array);
        std::vector<double> ratios(values.data(), values.data() + maps.size());
        if (kind == "b")
            for (double& ratio : ratios)
                ratio = ratio > 0 ? std::numeric_limits<double>::infinity() : 0.0;
        if (std::any_of(ratios.begin(), ratios.end(), [](double ratio) { return !(ratio >= 0); }))
            throw Error(ErrorKind::kUsage, "the cost model returned a number below 0 or NaN; a "
                                           "ratio of costs is 0 or more");
        return ratios;
    }
    uint32_t counts() const override { return counts_; }

private:
    uint32_t counts_;
    Held function_;
};

} // namespace

void addMapRows() {
    PYBIND11_NUMPY_DTYPE(MapRow, light, octave, texels, face_texels, pages, samples, clusters,
                         triangles, batches, lights, range, pairs, movers, mover_crossings, route,
                         pair_count);
}

py::array mapRows(const std::vector<MapRecord>& maps) {
    py::array_t<MapRow> rows(static_cast<py::ssize_t>(maps.size()));
    std::transform(maps.begin(), maps.end(), rows.mutable_data(), [](const MapRecord& map) {
        MapRow row = rowOf(map.quantities);
        row.route = uint8_t(map.route);
        row.pair_count = map.pairCount;
        return row;
    });
    return rows;
}

std::unique_ptr<CostModel> makeCallableModel(const py::object& function) {
    return std::make_unique<CallableModel>(function);
}

} // namespace shadowdag::python
