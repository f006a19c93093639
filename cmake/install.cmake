# What `cmake --install` puts where, and the Debian packages that CPack makes of it: simulcap, the
# program, and libsimulcap-dev, the libraries that other programs can link.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(installed_libraries avatar avatar_geometry bullet_ext bullet_ext_core)
if(NOT SIMULCAP_CORE_ONLY)
  list(APPEND installed_libraries avatar_digitization avatar_embedded_body avatar_io avatar_remeshing
       avatar_retargeting avatar_wardrobe)
endif()

set(config_folder ${CMAKE_INSTALL_LIBDIR}/cmake/simulcap)
install(
  TARGETS ${installed_libraries}
  EXPORT simulcap
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}/simulcap COMPONENT development)
install(
  DIRECTORY avatar bullet_ext
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/simulcap
  COMPONENT development
  FILES_MATCHING
  PATTERN "*.h"
  PATTERN "avatar/default_body" EXCLUDE)
install(
  FILES avatar/default_body/embedded_body.h
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/simulcap/avatar/default_body
  COMPONENT development)
install(
  EXPORT simulcap
  FILE simulcapTargets.cmake
  NAMESPACE simulcap::
  DESTINATION ${config_folder}
  COMPONENT development)
configure_package_config_file(cmake/simulcapConfig.cmake.in ${PROJECT_BINARY_DIR}/simulcapConfig.cmake
                              INSTALL_DESTINATION ${config_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/simulcapConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
install(
  FILES ${PROJECT_BINARY_DIR}/simulcapConfig.cmake
        ${PROJECT_BINARY_DIR}/simulcapConfigVersion.cmake cmake/dependencies.cmake
  DESTINATION ${config_folder}
  COMPONENT development)

if(NOT SIMULCAP_CORE_ONLY)
  install(TARGETS simulcap RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
  install(TARGETS simulcap_window LIBRARY DESTINATION lib/simulcap COMPONENT program)
  install(
    FILES ${PROJECT_BINARY_DIR}/simulcap.1
    DESTINATION ${CMAKE_INSTALL_MANDIR}/man1
    COMPONENT program)
  install(
    FILES ${PROJECT_BINARY_DIR}/simulcap.bash
    DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
    RENAME simulcap
    COMPONENT program)
  install(
    DIRECTORY scenes
    DESTINATION ${CMAKE_INSTALL_DATADIR}/simulcap
    COMPONENT program)
  install(
    FILES README.md LICENSE docs/architecture.md docs/formats.md docs/physics.md
    DESTINATION ${CMAKE_INSTALL_DOCDIR}
    COMPONENT program)
endif()

file(STRINGS scripts/packages needed_packages REGEX "-dev$")
list(REMOVE_ITEM needed_packages libgtest-dev)
list(JOIN needed_packages ", " needed_packages)
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "The SimulCap authors <simulcap@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Cloth capture inside a physics engine")
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME simulcap)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libsimulcap-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "${needed_packages}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
if(PROJECT_IS_TOP_LEVEL)
  include(CPack)
endif()
