#include "formats/content_hash.h"

#include <algorithm>

#include "formats/checksum.h"

namespace palpate {

void ContentHash::add_attribute(const std::string& name, const std::string& value) {
  lines_.push_back("attribute " + name + ' ' + value + '\n');
}

void ContentHash::add_attribute(const std::string& name, std::int64_t value) {
  add_attribute(name, std::to_string(value));
}

void ContentHash::add_dataset(const std::string& path, const std::string& checksum) {
  lines_.push_back("dataset " + path + ' ' + checksum + '\n');
}

std::string ContentHash::digits() const {
  std::vector<std::string> sorted = lines_;
  std::sort(sorted.begin(), sorted.end());
  std::string text;
  for (const std::string& line : sorted) text += line;
  return checksum(text);
}

void add_attributes(ContentHash& content, const Model& model, const FileHeader& header,
                    std::span<const std::int64_t> version) {
  content.add_attribute("format", "palpate");
  content.add_attribute("version", std::to_string(version[0]) + ' ' + std::to_string(version[1]));
  for_each_attribute(
      [&](const auto& attribute) { content.add_attribute(attribute.name, attribute.take(model, header)); });
}

}  // namespace palpate
