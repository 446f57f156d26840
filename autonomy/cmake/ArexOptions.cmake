# Compile options of every target of the house. It lives inside autonomy/ because autonomy builds alone.
include_guard(GLOBAL)

if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_CXX_FLAGS_RELEASE "-O3 -DNDEBUG")
set(CMAKE_CXX_FLAGS_DEBUG "-O1 -g1")

# For whoever builds all of it once; for work on the code, and for its tools, each source is a unit.
option(AREX_UNITY "Compile the sources of each library in batches" OFF)

find_program(CCACHE ccache)
if(CCACHE)
  # ccache sees through precompiled headers only with these.
  set(CMAKE_CXX_COMPILER_LAUNCHER
    ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros ${CCACHE})
endif()

find_package(Eigen3 3.4 REQUIRED)
find_package(Threads REQUIRED)

add_library(arex_options INTERFACE)
# x86-64-v3 for speed on every AVX2 host; no contraction and no fast-math, so that results are the
# same on all of them. EIGEN_MAX_ALIGN_BYTES=16 keeps the layout of Eigen's fixed-size types that of
# Debian's PCL. Heap blocks differ still: with AVX, Eigen's aligned_malloc pads them to 32 bytes,
# PCL's does not. No dynamic Eigen matrix and no cloud may be allocated on one side and freed on
# the other. EIGEN_FAST_MATH=0: else Eigen takes the root of floats by rsqrtps, whose digits are the
# CPU vendor's.
target_compile_options(arex_options INTERFACE
  -march=x86-64-v3 -ffp-contract=off -fpch-preprocess
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion
  # GCC 12 sees phantom overruns, overlaps and uninitialised reads in Eigen's vectorised assignments
  # and where a string is put behind a char pointer.
  -Wno-array-bounds -Wno-maybe-uninitialized -Wno-stringop-overflow -Wno-restrict
  # In a batch, sources are included, and GCC takes their anonymous namespaces for a header's.
  $<$<BOOL:${AREX_UNITY}>:-Wno-subobject-linkage>
  $<$<BOOL:${AREX_WERROR}>:-Werror>)
if(AREX_SANITIZE)
  target_compile_options(arex_options INTERFACE
    -fsanitize=${AREX_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(arex_options INTERFACE -fsanitize=${AREX_SANITIZE})
endif()
target_compile_definitions(arex_options INTERFACE
  EIGEN_MAX_ALIGN_BYTES=16 EIGEN_FAST_MATH=0
  $<$<CONFIG:Debug>:EIGEN_INITIALIZE_MATRICES_BY_NAN>)
target_link_libraries(arex_options INTERFACE Eigen3::Eigen Threads::Threads)

# Eigen and the heaviest std headers, precompiled once and reused by every target that asks.
add_library(arex_pch STATIC ${CMAKE_CURRENT_LIST_DIR}/pch.cpp)
target_link_libraries(arex_pch PUBLIC arex_options)
target_precompile_headers(arex_pch PRIVATE
  <Eigen/Core> <Eigen/Geometry> <Eigen/Dense> <algorithm> <array> <cmath> <cstdint> <functional>
  <map> <memory> <string> <unordered_map> <vector>)

# arex_library(NAME sources...): a static library with the house's options and precompiled header.
function(arex_library name)
  add_library(${name} STATIC ${ARGN})
  target_link_libraries(${name} PUBLIC arex_options)
  target_precompile_headers(${name} REUSE_FROM arex_pch)
  set_target_properties(${name} PROPERTIES UNITY_BUILD ${AREX_UNITY} UNITY_BUILD_BATCH_SIZE 8)
endfunction()
