# Every package that taihu links, found once; included by our own build and by taihuConfig.cmake.

# OpenVDB brings a find module instead of a config; Debian keeps it off the module path.
find_path(TAIHU_OPENVDB_MODULE FindOpenVDB.cmake
  PATHS /usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB /usr/lib/cmake/OpenVDB
        /usr/local/lib/cmake/OpenVDB /usr/lib64/cmake/OpenVDB
  DOC "Folder of FindOpenVDB.cmake")
set(_taihu_module_path "${CMAKE_MODULE_PATH}")
if(TAIHU_OPENVDB_MODULE)
  list(APPEND CMAKE_MODULE_PATH "${TAIHU_OPENVDB_MODULE}")
endif()
find_package(TBB REQUIRED CONFIG) # before OpenVDB, whose own search would take another one
# FindOpenVDB sets BUILD_SHARED_LIBS in its caller's scope.
set(_taihu_had_shared FALSE)
if(DEFINED BUILD_SHARED_LIBS)
  set(_taihu_had_shared TRUE)
  set(_taihu_shared "${BUILD_SHARED_LIBS}")
endif()
find_package(OpenVDB 10 REQUIRED COMPONENTS openvdb)
if(_taihu_had_shared)
  set(BUILD_SHARED_LIBS "${_taihu_shared}")
else()
  unset(BUILD_SHARED_LIBS)
endif()
set(CMAKE_MODULE_PATH "${_taihu_module_path}")

find_package(OpenSSL REQUIRED COMPONENTS Crypto)
find_package(Boost 1.74 REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(OpenMesh REQUIRED)
find_package(draco REQUIRED)
find_package(OpenEXR REQUIRED)
find_package(embree 3 REQUIRED)
find_package(PNG REQUIRED)
find_package(pugixml REQUIRED)
find_package(Qhull REQUIRED)
find_package(Threads REQUIRED)

# Debian's libzip-config.cmake insists on programs that other packages hold.
if(NOT TARGET libzip::zip)
  find_library(TAIHU_LIBZIP zip REQUIRED)
  find_path(TAIHU_LIBZIP_INCLUDE zip.h REQUIRED)
  add_library(libzip::zip UNKNOWN IMPORTED)
  set_target_properties(libzip::zip PROPERTIES
    IMPORTED_LOCATION "${TAIHU_LIBZIP}"
    INTERFACE_INCLUDE_DIRECTORIES "${TAIHU_LIBZIP_INCLUDE}")
endif()
