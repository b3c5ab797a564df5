// SPDX-License-Identifier: Apache-2.0
// Arrays of the library as numpy arrays and back, without copies.
#pragma once

#include "cuda/error.h"
#include "cuda/view.h"
#include "scenes/scene.h"

#include <pybind11/numpy.h>

#include <glm/glm.hpp>

#include <cstring>
#include <memory>
#include <string>
#include <vector>

namespace shadowdag::python {

namespace py = pybind11;

/// Returns a read-only array over memory of the library, which `owner` keeps alive as long as the
/// array.
template <class T, class Owner>
py::array arrayOver(const T* data, std::vector<py::ssize_t> shape,
                    const std::shared_ptr<Owner>& owner) {
    const py::capsule base(new std::shared_ptr<Owner>(owner), [](void* pointer) {
        delete static_cast<std::shared_ptr<Owner>*>(pointer);
    });
    py::array_t<T> array(std::move(shape), data, base);
    py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
    return array;
}

/// The same over a vector, (count).
template <class T, class Owner>
py::array arrayOver(const std::vector<T>& values, const std::shared_ptr<Owner>& owner) {
    return arrayOver(values.data(), {py::ssize_t(values.size())}, owner);
}

/// The same over vectors of three components, (count, 3).
template <class Scalar, class Owner>
py::array arrayOver3(const glm::vec<3, Scalar>* data, size_t count,
                     const std::shared_ptr<Owner>& owner) {
    static_assert(sizeof(glm::vec<3, Scalar>) == 3 * sizeof(Scalar));
    return arrayOver(reinterpret_cast<const Scalar*>(data), {py::ssize_t(count), 3}, owner);
}

/// Throws Error kUsage naming the array and the row unless a point is within kMaxCoordinate.
inline void requireWithinReach(const glm::dvec3& p, const char* array, size_t row) {
    if (!isWithinReach(p))
        throw Error(ErrorKind::kUsage,
                    std::string(array) + ": row " + std::to_string(row) + " is " + pointText(p) +
                        "; coordinates must be finite and at most 1e9 from the origin");
}

/// World points in an array of numpy, used where it lies.
class PointsOf {
public:
    /// Throws py::type_error unless the array holds float32, py::value_error unless its shape is
    /// (n, 3) or (3,). Strides are free. The array outlives this.
    /// @param name of the argument, for messages
    PointsOf(const py::array& array, const char* name) {
        if (!py::isinstance<py::array_t<float>>(array))
            throw py::type_error(std::string(name) + " holds " +
                                 std::string(py::str(array.dtype())) +
                                 "; it must be an array of float32, which is used without a copy: "
                                 "convert it with numpy.float32(" +
                                 name + ")");
        const bool isOne = array.ndim() == 1;
        if (array.ndim() < 1 || array.ndim() > 2 || array.shape(array.ndim() - 1) != 3)
            throw py::value_error(std::string(name) + " has the shape " +
                                  std::string(py::str(array.attr("shape"))) +
                                  "; it must be (n, 3), or (3,) for one point");
        data_ = static_cast<const char*>(array.data());
        isOne_ = isOne;
        count_ = isOne ? 1 : size_t(array.shape(0));
        rowBytes_ = isOne ? 0 : array.strides(0);
        axisBytes_ = array.strides(array.ndim() - 1);
    }

    bool isOne() const { return isOne_; }
    size_t count() const { return count_; }
    /// Returns a point; of one, itself for every index.
    glm::vec3 operator[](size_t i) const {
        const char* const row = data_ + py::ssize_t(i) * rowBytes_;
        glm::vec3 point;
        for (int a = 0; a < 3; ++a)
            std::memcpy(&point[a], row + a * axisBytes_, sizeof(float));
        return point;
    }

private:
    const char* data_;
    py::ssize_t rowBytes_, axisBytes_;
    size_t count_;
    bool isOne_;
};

/// Returns the number of segments between two lists of points of which either may be one. Throws
/// py::value_error for lists of different lengths.
inline size_t segmentCount(const PointsOf& from, const PointsOf& to) {
    if (!from.isOne() && !to.isOne() && from.count() != to.count())
        throw py::value_error("start has " + std::to_string(from.count()) + " points and end " +
                              std::to_string(to.count()) +
                              "; give as many of both, or one point for all");
    return from.isOne() ? to.count() : from.count();
}

/// Returns the array that receives one bool a segment: `out` if it is not None, else a new one.
/// Throws py::value_error for an `out` of another type, shape or layout.
inline py::array_t<bool> resultOf(const py::object& out, size_t count) {
    if (out.is_none())
        return py::array_t<bool>(py::ssize_t(count));
    if (!py::isinstance<py::array_t<bool, py::array::c_style>>(out) || py::array(out).ndim() != 1 ||
        size_t(py::array(out).shape(0)) != count || !py::array(out).writeable())
        throw py::value_error("out must be a writable, contiguous array of bool of the shape (" +
                              std::to_string(count) + ",)");
    return py::array_t<bool>(py::reinterpret_borrow<py::array_t<bool>>(out));
}

} // namespace shadowdag::python
