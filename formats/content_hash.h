// Hash of a whole file, from the checksums of its datasets and the values of its root attributes.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "formats/model_fields.h"

namespace palpate {

/// XXH3-128 of the sorted lines "attribute NAME VALUE" and "dataset PATH CHECKSUM", each ended by '\n'.
class ContentHash {
 public:
  void add_attribute(const std::string& name, const std::string& value);
  void add_attribute(const std::string& name, std::int64_t value);
  void add_dataset(const std::string& path, const std::string& checksum);
  [[nodiscard]] std::string digits() const;  ///< 32 hexadecimal digits

 private:
  std::vector<std::string> lines_;
};

/// Adds the format, its version and all root attributes of the table.
void add_attributes(ContentHash& content, const Model& model, const FileHeader& header,
                    std::span<const std::int64_t> version);

}  // namespace palpate
