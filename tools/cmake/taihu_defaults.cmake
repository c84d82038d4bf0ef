# What every target of taihu is built with, and how a module or a test is declared.
set(TAIHU_SANITIZE "" CACHE STRING "Sanitizers for our own code, as -fsanitize= takes them")

function(taihu_defaults target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_compile_options(${target} PRIVATE
    -ffp-contract=off # the same bits with and without fused multiply-add
    -fno-math-errno)  # or square roots do not vectorise
  if(PROJECT_IS_TOP_LEVEL)
    target_compile_options(${target} PRIVATE
      -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual -Werror
      $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>) # false alarms on string + string in GCC 12 (bug 105651)
  endif()
  if(TAIHU_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${TAIHU_SANITIZE} -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC -fsanitize=${TAIHU_SANITIZE})
    target_compile_definitions(${target} PRIVATE TAIHU_SANITIZED)
  endif()
  get_target_property(_type ${target} TYPE)
  if(TAIHU_SANITIZE MATCHES thread AND _type STREQUAL EXECUTABLE)
    target_sources(${target} PRIVATE ${PROJECT_SOURCE_DIR}/tests/support/tsan_tbb.cpp)
    target_link_libraries(${target} PRIVATE TBB::tbb ${CMAKE_DL_LIBS})
  endif()
endfunction()

# taihu_module(name SOURCES a.cpp ... HEADERS a.h ...): the library taihu_<name>, taihu::<name>.
# Every public header is also compiled alone.
function(taihu_module name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;HEADERS")
  add_library(taihu_${name})
  add_library(taihu::${name} ALIAS taihu_${name})
  set_target_properties(taihu_${name} PROPERTIES
    EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON
    VERIFY_INTERFACE_HEADER_SETS ${PROJECT_IS_TOP_LEVEL})
  taihu_defaults(taihu_${name})
  target_sources(taihu_${name}
    PRIVATE ${arg_SOURCES}
    PUBLIC FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR} FILES ${arg_HEADERS})
  install(TARGETS taihu_${name} EXPORT taihuTargets
    FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/taihu)
endfunction()

# taihu_tests(module SOURCES a_test.cpp ... LIBRARIES ...): one program, each test its own CTest entry.
function(taihu_tests module)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;LIBRARIES")
  add_executable(${module}_tests ${arg_SOURCES})
  taihu_defaults(${module}_tests)
  target_include_directories(${module}_tests PRIVATE ${PROJECT_SOURCE_DIR})
  target_compile_definitions(${module}_tests PRIVATE TAIHU_DATA="${PROJECT_SOURCE_DIR}/data")
  target_link_libraries(${module}_tests PRIVATE ${arg_LIBRARIES} GTest::gmock_main)
  if(arg_LIBRARIES MATCHES "vdb_ops|mesh_out") # half the time that these take to build
    target_precompile_headers(${module}_tests PRIVATE <gmock/gmock.h> <openvdb/openvdb.h>)
    target_compile_options(${module}_tests PRIVATE # the false alarms again, which this lets through
      $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds -Wno-stringop-overflow>)
  endif()
  add_dependencies(${module}_tests taihu_reader) # what they read, it reads for them
  gtest_discover_tests(${module}_tests TEST_PREFIX ${module}/ DISCOVERY_MODE PRE_TEST NO_PRETTY_VALUES
    PROPERTIES LABELS unit TIMEOUT 300)
endfunction()
