#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "runs.h"

// The parts of the module rayrep._rayrep, a source each.

namespace pybind11::detail {

/// What Mesh.__new__ gives holds no mesh: pybind11 would hand on memory that nobody has written.
template <>
struct type_caster<rayrep::python::Body> : type_caster_base<rayrep::python::Body> {
  bool load(handle given, bool convert) {
    const bool is_mesh = isinstance<rayrep::python::Body>(given);
    return is_mesh && reinterpret_cast<instance*>(given.ptr())->get_value_and_holder().holder_constructed() &&
           type_caster_base<rayrep::python::Body>::load(given, convert);
  }
};

}  // namespace pybind11::detail

namespace rayrep::python {

void bind_mesh(pybind11::module_& module);
void bind_physics(pybind11::module_& module);
void bind_runs(pybind11::module_& module);

/// Text that may hold the name of a file, which need not be UTF-8.
pybind11::str str_of(const std::string& text);
std::vector<pybind11::str> strs_of(const std::vector<std::string>& texts);

/// A point, a vector or a tensor as an array of its own.
pybind11::array_t<double> array_of(const Eigen::Vector3d& v);
pybind11::array_t<double> array_of(const Eigen::Matrix3d& m);
pybind11::array_t<double> array_of(const std::vector<double>& values);
/// Rows of three.
pybind11::array_t<double> array_of(const std::vector<Eigen::Vector3d>& points);

/// Its fields by the names of rayrep.MassProperties.
pybind11::dict mass_dict(const MassProperties& mass);

}  // namespace rayrep::python
