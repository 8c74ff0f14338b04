# cmake -D page=FILE -D source=OUT -P carry_page.cmake: writes the source that carries the page.
file(SHA256 ${page} page_hash)
configure_file(${CMAKE_CURRENT_LIST_DIR}/viewer_page.cpp.in ${source} @ONLY)
