# Compiler settings shared by all of our own code. Dependencies are SYSTEM, so they stay silent.
add_library(simulcap_warnings INTERFACE)
target_compile_options(
  simulcap_warnings
  INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-Wall
            -Wextra
            -Wpedantic
            -Wshadow
            -Wnon-virtual-dtor
            -Woverloaded-virtual
            -Wold-style-cast
            -Wcast-align
            -Wconversion
            -Wdouble-promotion
            -Wformat=2
            -Wnull-dereference
            -Wextra-semi
            -Werror
            # No -Wsign-conversion: Eigen and Bullet index with signed integers.
            -Wno-sign-conversion
            # Options structs are written {.name = value}: what isn't named keeps its default.
            -Wno-missing-field-initializers>)
# GCC 12 sees overlaps in inlined std::string concatenation that aren't there (GCC bug 105651).
target_compile_options(simulcap_warnings INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>)
# Types that use the anonymous namespace are fine in a source that a unity build includes. What GCC 12
# inlines across such sources makes it see accesses beyond bounds that aren't there.
if(CMAKE_UNITY_BUILD)
  target_compile_options(
    simulcap_warnings INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage -Wno-array-bounds
                                -Wno-stringop-overread -Wno-stringop-overflow>)
endif()
# Same bytes for the same source on every x86-64 machine: never fuse a*b+c behind our back.
target_compile_options(simulcap_warnings INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-ffp-contract=off>)

if(SIMULCAP_SANITIZE)
  # The three left out are checks of every access that AddressSanitizer makes too, and a third of
  # the compile time.
  add_compile_options(-fsanitize=address,undefined -fno-sanitize=null,alignment,object-size
                      -fno-sanitize-recover=all -fno-omit-frame-pointer)
  add_link_options(-fsanitize=address,undefined)
  # GCC 12 reports false positives from inlined Eigen code under the sanitizers.
  target_compile_options(simulcap_warnings INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-null-dereference
                                                     -Wno-maybe-uninitialized>)
endif()
if(SIMULCAP_FUZZ)
  # Numbers of a file that no integer can hold are what a fuzzer finds first.
  add_compile_options($<$<COMPILE_LANGUAGE:CXX>:-fsanitize=fuzzer-no-link,float-cast-overflow>)
  add_link_options(-fsanitize=float-cast-overflow)
  # Releases are compiled by GCC: Clang's other opinions don't matter here.
  target_compile_options(simulcap_warnings INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-w>)
endif()

# simulcap_library(NAME FILES...): one static library of our own code, included from the top of
# the tree ("avatar/geometry/mesh.h").
# Other projects call it simulcap::NAME, built with them or installed.
function(simulcap_library name)
  add_library(${name} STATIC ${ARGN})
  add_library(simulcap::${name} ALIAS ${name})
  target_include_directories(${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
                                            $<INSTALL_INTERFACE:include/simulcap>)
  target_compile_features(${name} PUBLIC cxx_std_20)
  target_link_libraries(${name} PRIVATE $<BUILD_INTERFACE:simulcap_warnings>)
endfunction()

# simulcap_executable(NAME FILES...): one program of our own code.
function(simulcap_executable name)
  add_executable(${name} ${ARGN})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE simulcap_warnings)
endfunction()
