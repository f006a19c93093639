# The only find_package calls of the project: all are Debian 12's own packages (scripts/packages).
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(Threads REQUIRED)
find_package(GTest REQUIRED)

if(NOT SIMULCAP_CORE_ONLY)
  find_package(OpenMesh REQUIRED)
  # Through pkg-config: Debian's libzip CMake file wants command-line tools that we don't need.
  find_package(PkgConfig REQUIRED)
  pkg_check_modules(libzip REQUIRED IMPORTED_TARGET libzip)
  find_package(CLI11 REQUIRED)
  find_package(spdlog REQUIRED)
  find_package(nlohmann_json REQUIRED)
  find_package(OpenCV REQUIRED COMPONENTS core imgproc imgcodecs)
endif()
