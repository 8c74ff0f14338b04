# How our libraries are compiled: by the whole project and by runtime/core, which can be built alone.
get_filename_component(PALPATE_TREE ${CMAKE_CURRENT_LIST_DIR}/.. ABSOLUTE)
set(PALPATE_BUILD ${CMAKE_CURRENT_BINARY_DIR})

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

# One set of flags for all, whether it ends in a program or in libpalpate, so that headers are compiled once for all.
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)

# Warnings, optimisation and sanitizers shared by all of our targets.
add_library(palpate_options INTERFACE)
target_compile_options(palpate_options INTERFACE -Wall -Wextra -Wpedantic -Wconversion -Wshadow)
# Outside of kernels no product and sum become one rounding: which ones would is up to what the compiler inlines, and with it every last bit.
target_compile_options(palpate_options INTERFACE -ffp-contract=off)
target_compile_definitions(palpate_options INTERFACE PALPATE_VERSION="${PROJECT_VERSION}")
if(PALPATE_WERROR)
  target_compile_options(palpate_options INTERFACE -Werror)
endif()
if(PALPATE_NATIVE)
  target_compile_options(palpate_options INTERFACE -march=native)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)  # GCC 12 is wrong in its own AVX, regex and string headers (GCC bugs 105593, 105562, 105651)
  target_compile_options(palpate_options INTERFACE -Wno-maybe-uninitialized -Wno-uninitialized -Wno-restrict)
  if(PALPATE_SANITIZE MATCHES thread)
    target_compile_options(palpate_options INTERFACE -Wno-tsan)  # of fences in the standard library
  endif()
  # Where the processor has AVX without AVX-512 and where it has both, GCC 12 sees other packets read past vectors of three doubles.
  target_compile_options(palpate_options INTERFACE -Wno-array-bounds -Wno-stringop-overread -Wno-stringop-overflow)
endif()
if(PALPATE_SANITIZE)
  target_compile_options(palpate_options INTERFACE -fsanitize=${PALPATE_SANITIZE} -fno-omit-frame-pointer
                                                   -fno-sanitize-recover=all)
  target_link_options(palpate_options INTERFACE -fsanitize=${PALPATE_SANITIZE})
endif()

# palpate_shared_headers(NAME [LIBS lib ...] [HEADERS <x.h> ...]): headers of others that most sources include, compiled once for all libraries with the flags of LIBS.
function(palpate_shared_headers name)
  cmake_parse_arguments(ARG "" "" "LIBS;HEADERS" ${ARGN})
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp CONTENT "")
  add_library(${name} STATIC ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
  target_link_libraries(${name} PUBLIC palpate_options Eigen3::Eigen ${ARG_LIBS})
  target_precompile_headers(${name} PRIVATE <Eigen/Core> <Eigen/Geometry> <Eigen/LU> <algorithm> <array> <atomic> <chrono> <filesystem>
    <functional> <map> <memory> <mutex> <optional> <span> <string> <thread> <vector> ${ARG_HEADERS})
endfunction()

# palpate_headers_of_all([HEADERS <x.h> ...]): those of all libraries, and once more for kernels.
macro(palpate_headers_of_all)
  palpate_shared_headers(palpate_headers ${ARGN})
  palpate_shared_headers(palpate_kernel_headers LIBS palpate_kernel_options ${ARGN})
  set(PALPATE_HEADERS palpate_headers)
  set(PALPATE_KERNEL_HEADERS palpate_kernel_headers)
endmacro()

# palpate_library(NAME [SHELL] SOURCES a.cpp ... [KERNELS k.cpp ...] [LIBS lib ...] [PRIVATE lib ...]): the library of the folder that calls it. SHELL:
# its sources wait for people, disks and networks (palpate_shell_options). Who links it can include the folder's headers, as "FOLDER/x.h", and those of
# LIBS; the headers of no other folder can be found at all.
function(palpate_library name)
  cmake_parse_arguments(ARG "SHELL" "" "SOURCES;KERNELS;LIBS;PRIVATE" ${ARGN})
  if(ARG_SOURCES OR ARG_KERNELS)
    add_library(${name} STATIC ${ARG_SOURCES})
    target_link_libraries(${name} PUBLIC palpate_options ${ARG_LIBS} PRIVATE ${ARG_PRIVATE})
    if(ARG_SHELL)
      target_link_libraries(${name} PRIVATE palpate_shell_options)
      target_precompile_headers(${name} REUSE_FROM palpate_shell_headers)
    else()
      target_precompile_headers(${name} REUSE_FROM ${PALPATE_HEADERS})
    endif()
    palpate_show_headers(${name} PUBLIC ${CMAKE_CURRENT_SOURCE_DIR})
  else()
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE palpate_options ${ARG_LIBS})
    palpate_show_headers(${name} INTERFACE ${CMAKE_CURRENT_SOURCE_DIR})
  endif()
  if(ARG_KERNELS)
    add_library(${name}_kernels OBJECT ${ARG_KERNELS})
    target_link_libraries(${name}_kernels PRIVATE palpate_options ${ARG_LIBS} palpate_kernel_options)
    target_precompile_headers(${name}_kernels REUSE_FROM ${PALPATE_KERNEL_HEADERS})
    target_include_directories(${name}_kernels PRIVATE ${PALPATE_BUILD}/include/${name})
    set_target_properties(${name}_kernels PROPERTIES UNITY_BUILD OFF)  # what the compiler inlines into a tick hangs on nothing beside it
    target_sources(${name} PRIVATE $<TARGET_OBJECTS:${name}_kernels>)
  endif()
endfunction()

# Links to a folder's headers, by which a target can include them.
function(palpate_show_headers target visibility folder)
  file(GLOB headers CONFIGURE_DEPENDS ${folder}/*.h)
  file(RELATIVE_PATH name ${PALPATE_TREE} ${folder})
  set(shown ${PALPATE_BUILD}/include/${target})
  file(REMOVE_RECURSE ${shown}/${name})
  file(MAKE_DIRECTORY ${shown}/${name})
  foreach(header IN LISTS headers)
    get_filename_component(file ${header} NAME)
    file(CREATE_LINK ${header} ${shown}/${name}/${file} SYMBOLIC)
  endforeach()
  target_include_directories(${target} ${visibility} $<BUILD_INTERFACE:${shown}>)
endfunction()

# Of all programs and libraries: what the loader has resolved cannot be written over, the stack and known sizes are watched.
if(NOT WIN32)
  add_link_options(LINKER:-z,relro,-z,now)
endif()
if(NOT PALPATE_SANITIZE AND NOT WIN32)
  add_compile_options(-fstack-protector-strong "$<$<NOT:$<CONFIG:Debug>>:-U_FORTIFY_SOURCE;-D_FORTIFY_SOURCE=2>")
  set(PALPATE_UNWATCHED -fno-stack-protector SHELL:-U_FORTIFY_SOURCE)  # for kernels; CMake drops a flag that was there before, but for SHELL:
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    add_compile_options(-fstack-clash-protection -fcf-protection)
    list(APPEND PALPATE_UNWATCHED -fno-stack-clash-protection -fcf-protection=none)
  endif()
endif()

# Shells take longer to compile than ever to run. Outside of kernels no optimisation rounds otherwise than another. A precompiled header brings its level
# of optimisation along: theirs is their own.
add_library(palpate_shell_options INTERFACE)
target_compile_options(palpate_shell_options INTERFACE "$<$<CONFIG:Release>:-O1>")

# The kernels: vectorised loops with fused multiply-add, as fast as memory, in every build that is not for the debugger. They see only sizes
# that were checked at load, no text and no bytes from outside, so that stack and sizes are watched around them and not in them. To be linked
# last, as the last flag counts.
add_library(palpate_kernel_options INTERFACE)
target_compile_options(palpate_kernel_options INTERFACE -fopenmp-simd -fno-math-errno "$<$<NOT:$<CONFIG:Debug>>:-O3;-ffp-contract=fast>" ${PALPATE_UNWATCHED})
if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
  target_compile_options(palpate_kernel_options INTERFACE -Wno-pass-failed)  # with sanitizers some loops stay as they are
endif()
