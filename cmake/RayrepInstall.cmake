# `cmake --install`: the library with its CMake package and headers, the command with its man page and completion.
include(CMakePackageConfigHelpers)
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME development)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/rayrep)

install(TARGETS rayrep EXPORT rayrep-targets)
install(DIRECTORY include/rayrep DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h")
install(EXPORT rayrep-targets NAMESPACE rayrep:: DESTINATION ${package_dir})

configure_package_config_file(cmake/rayrep-config.cmake.in rayrep-config.cmake INSTALL_DESTINATION ${package_dir}
                              NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(rayrep-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/rayrep-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/rayrep-config-version.cmake
              cmake/FindOpenVDBLibrary.cmake cmake/FindIpoptLibrary.cmake
        DESTINATION ${package_dir})

if(RAYREP_BUILD_TOOLS)
  # Only matters for a shared librayrep.
  set_target_properties(rayrep_tool PROPERTIES INSTALL_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}")
  install(TARGETS rayrep_tool COMPONENT command)
  install(FILES ${PROJECT_BINARY_DIR}/rayrep.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT command)
  install(FILES ${PROJECT_BINARY_DIR}/rayrep.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME rayrep
          COMPONENT command)
endif()
