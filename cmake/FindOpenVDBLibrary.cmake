# Finds OpenVDB and gives the target OpenVDB::openvdb.
#
# In place of Debian's FindOpenVDB.cmake, which asks for packages that using the library does not need and turns
# BUILD_SHARED_LIBS on in the caller's scope. The name differs so that neither can be taken for the other.
include(CMakeFindDependencyMacro)
find_dependency(TBB)
find_path(OpenVDB_INCLUDE_DIR openvdb/openvdb.h)
find_library(OpenVDB_LIBRARY openvdb)
# OpenVDB's headers call into Imath. Its own CMake package complains about a part that Debian leaves out.
find_library(Imath_LIBRARY NAMES Imath-3_1 Imath)
mark_as_advanced(OpenVDB_INCLUDE_DIR OpenVDB_LIBRARY Imath_LIBRARY)

set(OpenVDBLibrary_VERSION)
if(OpenVDB_INCLUDE_DIR)
  foreach(part MAJOR MINOR PATCH)
    file(STRINGS "${OpenVDB_INCLUDE_DIR}/openvdb/version.h" line REGEX "define OPENVDB_LIBRARY_${part}_VERSION_NUMBER ")
    string(REGEX MATCH "[0-9]+" number "${line}")
    list(APPEND OpenVDBLibrary_VERSION "${number}")
  endforeach()
  list(JOIN OpenVDBLibrary_VERSION . OpenVDBLibrary_VERSION)
endif()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenVDBLibrary REQUIRED_VARS OpenVDB_LIBRARY OpenVDB_INCLUDE_DIR Imath_LIBRARY
                                  VERSION_VAR OpenVDBLibrary_VERSION)

if(OpenVDBLibrary_FOUND AND NOT TARGET OpenVDB::openvdb)
  add_library(OpenVDB::openvdb UNKNOWN IMPORTED)
  set_target_properties(OpenVDB::openvdb PROPERTIES IMPORTED_LOCATION "${OpenVDB_LIBRARY}")
  target_include_directories(OpenVDB::openvdb SYSTEM INTERFACE "${OpenVDB_INCLUDE_DIR}")
  target_link_libraries(OpenVDB::openvdb INTERFACE TBB::tbb "${Imath_LIBRARY}")
endif()
