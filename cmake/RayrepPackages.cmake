# `cpack -G DEB` in a build folder (preset release): rayrep_VERSION_ARCH.deb, the command, and librayrep-dev_..., what is built with it.
# With RAYREP_PYTHON also python3-rayrep. tests/packages/run.sh installs and runs them on a bare Debian 12.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "the rayrep authors <rayrep@example.org>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # would go before each package's own
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL command development)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

set(CPACK_DEBIAN_COMMAND_PACKAGE_NAME rayrep)
set(CPACK_DEBIAN_COMMAND_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_COMMAND_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_COMMAND_PACKAGE_SUGGESTS "prusa-slicer, blender")
set(CPACK_COMPONENT_COMMAND_DESCRIPTION
    "decides what is inside a 3D print\nComputes the inside of a closed mesh, cavities, infill or heavier cores, such\nthat the print floats upright at a chosen waterline, spins stably, stands, or\nhas the mass, centre of mass and inertia of a model, proves how good the\nresult is, and writes what a slicer prints.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME librayrep-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
# What a program that is linked to it statically asks for again (rayrep-config.cmake).
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
    "libeigen3-dev, libtbb-dev, libembree-dev, libopenvdb-dev, coinor-libipopt-dev, libboost-dev, libzip-dev, libpng-dev, libcairo2-dev, libpugixml-dev, pkg-config")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION
    "rayrep as a C++ library\nStatic library, headers and CMake package: find_package(rayrep) gives the\ntarget rayrep::rayrep.")

if(RAYREP_PYTHON)
  list(APPEND CPACK_COMPONENTS_ALL python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-rayrep)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= 3.11), python3 (<< 3.12), python3-numpy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-matplotlib, prusa-slicer")
  set(CPACK_COMPONENT_PYTHON_DESCRIPTION
      "hollows 3D prints so that they float, spin or stand (Python)\nMeshes as numpy arrays in, hollowed and judged ones out, with hydrostatics,\nstable speeds, tipping angles and what G-code prints: import rayrep.")
endif()
include(CPack)
