# cmake -D page=FILE -D source=OUT -P carry_page.cmake: writes the source that carries the page.
file(SHA256 ${page} page_hash)
file(STRINGS ${page} sources REGEX "^<meta name=\"sources\" content=\"[^\"]*\">$" LIMIT_INPUT 4096)
if(NOT sources)
  set(sources "content=\"'none'\"")
endif()
string(REGEX REPLACE "^.*content=\"([^\"]*)\".*$" "\\1" page_sources "${sources}")
configure_file(${CMAKE_CURRENT_LIST_DIR}/viewer_page.cpp.in ${source} @ONLY)
