# Finds Ipopt and gives the target Ipopt::ipopt.
#
# Debian has no CMake package for it, only pkg-config's. Of that only the flags of Ipopt itself are taken: the shared
# library names the solvers it needs.
find_package(PkgConfig QUIET)
if(PkgConfig_FOUND)
  pkg_check_modules(PC_IPOPT QUIET ipopt)
endif()
find_path(Ipopt_INCLUDE_DIR IpTNLP.hpp HINTS ${PC_IPOPT_INCLUDE_DIRS} PATH_SUFFIXES coin coin-or)
find_library(Ipopt_LIBRARY ipopt HINTS ${PC_IPOPT_LIBRARY_DIRS})
mark_as_advanced(Ipopt_INCLUDE_DIR Ipopt_LIBRARY)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(IpoptLibrary REQUIRED_VARS Ipopt_LIBRARY Ipopt_INCLUDE_DIR
                                  VERSION_VAR PC_IPOPT_VERSION)

if(IpoptLibrary_FOUND AND NOT TARGET Ipopt::ipopt)
  add_library(Ipopt::ipopt UNKNOWN IMPORTED)
  set_target_properties(Ipopt::ipopt PROPERTIES IMPORTED_LOCATION "${Ipopt_LIBRARY}")
  target_include_directories(Ipopt::ipopt SYSTEM INTERFACE "${Ipopt_INCLUDE_DIR}")
  target_compile_definitions(Ipopt::ipopt INTERFACE HAVE_CSTDDEF)  # Ipopt 3.11's headers stop without it
endif()
