# What the libraries need: all are Debian 12's own packages (scripts/packages). Installed beside
# simulcapConfig.cmake, for whoever links the libraries.
include_guard(DIRECTORY)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(Threads REQUIRED)
# By hand: Debian's Bullet CMake file names libraries without their folder. Single precision.
find_path(Bullet_INCLUDE_DIR btBulletDynamicsCommon.h PATH_SUFFIXES bullet REQUIRED)
add_library(bullet INTERFACE IMPORTED)
target_include_directories(bullet SYSTEM INTERFACE "${Bullet_INCLUDE_DIR}")
foreach(library BulletSoftBody BulletDynamics BulletCollision LinearMath)
  find_library(${library}_LIBRARY ${library} REQUIRED)
  target_link_libraries(bullet INTERFACE "${${library}_LIBRARY}")
endforeach()

if(NOT SIMULCAP_CORE_ONLY)
  find_package(OpenMesh REQUIRED)
  find_package(assimp REQUIRED)
  # Through pkg-config: Debian's libzip CMake file wants command-line tools that we don't need.
  find_package(PkgConfig REQUIRED)
  pkg_check_modules(libzip REQUIRED IMPORTED_TARGET libzip)
  pkg_check_modules(libav REQUIRED IMPORTED_TARGET libavformat libavcodec libavutil)
  find_package(ZLIB REQUIRED)
  find_package(CLI11 REQUIRED)
  find_package(spdlog REQUIRED)
  find_package(nlohmann_json REQUIRED)
  # By hand: Debian's tinygltf comes as a library without a CMake file.
  find_path(tinygltf_INCLUDE_DIR tiny_gltf.h REQUIRED)
  find_library(tinygltf_LIBRARY tinygltf REQUIRED)
  add_library(tinygltf SHARED IMPORTED)
  set_target_properties(tinygltf PROPERTIES IMPORTED_LOCATION "${tinygltf_LIBRARY}"
                                            INTERFACE_INCLUDE_DIRECTORIES "${tinygltf_INCLUDE_DIR}")
  # By hand: OpenCV's own CMake file is in Debian's libopencv-dev, which brings 240 packages more.
  find_path(OpenCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
  foreach(module core imgproc imgcodecs dnn)
    find_library(opencv_${module}_LIBRARY opencv_${module} REQUIRED)
    add_library(opencv_${module} SHARED IMPORTED)
    set_target_properties(
      opencv_${module} PROPERTIES IMPORTED_LOCATION "${opencv_${module}_LIBRARY}"
                                  INTERFACE_INCLUDE_DIRECTORIES "${OpenCV_INCLUDE_DIR}")
  endforeach()
  # By hand: PCL's CMake file looks for VTK and Qt as well. Only what plane fitting, surface
  # reconstruction and cameras need.
  find_path(PCL_INCLUDE_DIR pcl/pcl_config.h PATH_SUFFIXES pcl-1.13 pcl-1.12 pcl-1.14 REQUIRED)
  foreach(module common io kdtree sample_consensus search surface visualization)
    find_library(pcl_${module}_LIBRARY pcl_${module} REQUIRED)
    add_library(pcl_${module} SHARED IMPORTED)
    set_target_properties(
      pcl_${module} PROPERTIES IMPORTED_LOCATION "${pcl_${module}_LIBRARY}"
                               INTERFACE_INCLUDE_DIRECTORIES "${PCL_INCLUDE_DIR}")
    target_link_libraries(pcl_${module} INTERFACE Eigen3::Eigen)
  endforeach()
  target_link_libraries(pcl_sample_consensus INTERFACE pcl_common)
  # PCL's grabber includes OpenNI2's header by its bare name.
  find_path(OpenNI2_INCLUDE_DIR OpenNI.h PATH_SUFFIXES openni2 REQUIRED)
  target_include_directories(pcl_io SYSTEM INTERFACE "${OpenNI2_INCLUDE_DIR}")
  target_link_libraries(pcl_io INTERFACE pcl_common)
  find_path(VTK_INCLUDE_DIR vtkPolyData.h PATH_SUFFIXES vtk-9.1 vtk-9.2 vtk-9.3 REQUIRED)
  target_include_directories(pcl_visualization SYSTEM INTERFACE "${VTK_INCLUDE_DIR}")
  foreach(module CommonCore CommonDataModel CommonExecutionModel CommonMath RenderingCore)
    file(GLOB found "/usr/lib/*/libvtk${module}-9.*.so")
    target_link_libraries(pcl_visualization INTERFACE ${found})
  endforeach()
  target_link_libraries(pcl_visualization INTERFACE pcl_io pcl_common)
  target_link_libraries(pcl_surface INTERFACE pcl_search pcl_kdtree pcl_common)
endif()
