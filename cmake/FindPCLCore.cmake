# pcl::core, the parts of PCL that cut clouds. Its own config would look for VTK, Qt and MPI as well, and its list of
# libraries hands on their definitions and -fopenmp. The library of segmentation is left out: with that of features, which it
# needs, it takes two thirds of the time in which a program starts.
find_path(PCL_INCLUDE_DIR pcl/point_types.h PATH_SUFFIXES pcl-1.15 pcl-1.14 pcl-1.13 pcl-1.12)
set(libraries)
foreach(part common kdtree search sample_consensus filters)
  find_library(PCL_${part}_LIBRARY pcl_${part})
  list(APPEND libraries PCL_${part}_LIBRARY)
endforeach()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(PCLCore REQUIRED_VARS PCL_INCLUDE_DIR ${libraries})
mark_as_advanced(PCL_INCLUDE_DIR ${libraries})
if(PCLCore_FOUND AND NOT TARGET pcl::core)
  add_library(pcl::core INTERFACE IMPORTED)
  target_include_directories(pcl::core INTERFACE ${PCL_INCLUDE_DIR})
  foreach(library IN LISTS libraries)
    target_link_libraries(pcl::core INTERFACE ${${library}})
  endforeach()
endif()
