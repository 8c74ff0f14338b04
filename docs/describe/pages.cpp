#include "docs/describe/pages.h"

#include "docs/describe/markdown.h"

namespace palpate {

std::vector<Page> reference_pages() {
  std::vector<Page> pages = {model_keys_page(),  play_options_page(),     safety_bounds_page(),
                             file_fields_page(), recording_fields_page(), status_bits_page(),
                             tuning_page(),      exit_statuses_page()};
  for (Page& page : pages)
    page.text = "<!-- Written by palpate-describe from the tables of the code: edit those. -->\n\n" +
                with_short_lines(page.text);
  return pages;
}

}  // namespace palpate
