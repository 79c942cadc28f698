# Builds ur-rtde with the pybind11 of this machine instead of one that is fetched, and without its examples.
set(FETCHCONTENT_SOURCE_DIR_PYBIND11-SRC ${CMAKE_CURRENT_LIST_DIR}/pybind11)
set(EXAMPLES OFF)
