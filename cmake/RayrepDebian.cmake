# What Debian's policy and desktops ask of packages besides programs and libraries: tests/packages/run.sh has lintian look at it.

# Changelogs and licences of one package, into its component. A version is a new entry of cmake/debian/changelog.
function(rayrep_debian_documents package component)
  set(texts ${PROJECT_BINARY_DIR}/debian/${package})
  file(MAKE_DIRECTORY ${texts})
  # Without a name or time in them: the same bytes each time.
  execute_process(COMMAND gzip -9nc ${PROJECT_SOURCE_DIR}/cmake/debian/changelog OUTPUT_FILE ${texts}/changelog.Debian.gz COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND gzip -9nc ${PROJECT_SOURCE_DIR}/CHANGELOG.md OUTPUT_FILE ${texts}/changelog.gz COMMAND_ERROR_IS_FATAL ANY)
  install(FILES ${texts}/changelog.Debian.gz ${texts}/changelog.gz ${PROJECT_SOURCE_DIR}/cmake/debian/copyright ${PROJECT_SOURCE_DIR}/THIRD_PARTY.md
          DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component})
endfunction()

rayrep_debian_documents(librayrep-dev development)
if(RAYREP_BUILD_TOOLS)
  rayrep_debian_documents(rayrep command)
  install(FILES tools/desktop/rayrep-studio.desktop DESTINATION ${CMAKE_INSTALL_DATADIR}/applications COMPONENT command)
  install(FILES tools/desktop/rayrep.svg DESTINATION ${CMAKE_INSTALL_DATADIR}/icons/hicolor/scalable/apps COMPONENT command)
  install(FILES tools/blender/rayrep_addon.py DESTINATION ${CMAKE_INSTALL_DATADIR}/rayrep COMPONENT command)
  install(PROGRAMS tools/slicers/judge_print.sh DESTINATION ${CMAKE_INSTALL_DATADIR}/rayrep COMPONENT command)
endif()
if(RAYREP_PYTHON)
  rayrep_debian_documents(python3-rayrep python)
  install(FILES docs/python.md DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/python3-rayrep COMPONENT python)
endif()
