#include <string>

#include "bindings.h"

namespace py = pybind11;

namespace {

using rayrep::Error;
using rayrep::ErrorCode;

const char* class_for(ErrorCode code) {
  switch (code) {
    case ErrorCode::usage:
      return "UsageError";
    case ErrorCode::input:
      return "InputError";
    case ErrorCode::goal:
      return "GoalError";
    case ErrorCode::solver:
      return "SolverError";
    case ErrorCode::write:
      return "WriteError";
    case ErrorCode::interrupted:
      return "Interrupted";
    case ErrorCode::internal:
      break;
  }
  return "Error";
}

void translate(std::exception_ptr thrown) {
  try {
    if (thrown) std::rethrow_exception(thrown);
  } catch (const Error& error) {
    const py::module_ errors = py::module_::import("rayrep._errors");
    PyErr_SetObject(errors.attr(class_for(error.code())).ptr(),
                    errors.attr("in_python")(rayrep::python::str_of(error.what())).ptr());
  }
}

}  // namespace

PYBIND11_MODULE(_rayrep, module) {
  module.attr("__version__") = rayrep::version();
  py::register_local_exception_translator(&translate);
  rayrep::python::bind_mesh(module);
  rayrep::python::bind_physics(module);
  rayrep::python::bind_runs(module);
}
