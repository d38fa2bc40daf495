include(CMakePackageConfigHelpers)

# flash_library(<module> [SOURCES ...]): the library target flash_<module>, alias flash::<module>, from the given
# sources or, without any, from all of this folder.
function(flash_library module)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES")
  if(NOT arg_SOURCES)
    file(GLOB arg_SOURCES CONFIGURE_DEPENDS *.cpp)
  endif()
  set(target flash_${module})
  add_library(${target} ${arg_SOURCES})
  add_library(flash::${module} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${module} POSITION_INDEPENDENT_CODE ON)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
                                              $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/flash>)
  target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:flash_options>)
  install(TARGETS ${target} EXPORT flashTargets)
endfunction()

# Headers by their path from the root, so that `#include "sim/newton/solver.h"` reads the same inside and outside; those of
# calib and sysid, of which a part is installed, in their own CMakeLists.txt.
function(flash_install)
  foreach(module data sim)
    install(DIRECTORY ${PROJECT_SOURCE_DIR}/${module} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/flash
            FILES_MATCHING PATTERN "*.h" PATTERN json_reader.h EXCLUDE PATTERN kernels EXCLUDE
            PATTERN cuda EXCLUDE)
  endforeach()
  set(destination ${CMAKE_INSTALL_LIBDIR}/cmake/flash)
  set(has_calib OFF)
  if(TARGET flash_calib)
    set(has_calib ON)
  endif()
  install(EXPORT flashTargets NAMESPACE flash:: DESTINATION ${destination})
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/flashConfig.cmake.in
                                ${PROJECT_BINARY_DIR}/flashConfig.cmake INSTALL_DESTINATION ${destination})
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/flashConfigVersion.cmake COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/flashConfig.cmake ${PROJECT_BINARY_DIR}/flashConfigVersion.cmake
          DESTINATION ${destination})
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/docs/licences.md
          DESTINATION ${CMAKE_INSTALL_DOCDIR})
endfunction()
