// Report descriptor of a HID device (USB Device Class Definition for HID 1.11, section 6.2.2).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace palpate {

enum class HidReportType : std::uint8_t { input, output, feature };

/// Meaning of a number: a page of the HID Usage Tables and an id on it.
struct HidUsage {
  std::uint16_t page = 0;
  std::uint16_t id = 0;
  friend bool operator==(const HidUsage&, const HidUsage&) = default;
};

/// Numbers of equal size, consecutive in a report. Padding is not kept.
struct HidField {
  HidReportType type = HidReportType::input;
  std::uint8_t report_id = 0;
  bool variable = true;     ///< each number has a usage of its own; otherwise it selects one of the usages
  std::uint32_t bit = 0;    ///< offset of the first, after the report id
  std::uint32_t bits = 0;   ///< size of each
  std::uint32_t count = 0;  ///< number of them
  std::int64_t logical_min = 0;
  std::int64_t logical_max = 0;
  std::vector<HidUsage> usages;       ///< variable: one per number, the last one repeated; otherwise the
                                      ///< alternatives
  std::vector<HidUsage> collections;  ///< enclosing collections, from the outermost
};

/// One number in a report.
struct HidElement {
  HidReportType type = HidReportType::input;
  std::uint8_t report_id = 0;
  std::uint16_t report_bytes = 0;  ///< size of the whole report, without the report id
  std::uint32_t bit = 0;           ///< offset, after the report id
  std::uint32_t bits = 0;          ///< 1 to 32
  std::int64_t logical_min = 0;
  std::int64_t logical_max = 0;
};

/// Number and its value that selects a certain usage.
struct HidOption {
  HidElement element;
  std::int64_t value = 0;
};

/// Parsed report descriptor.
struct HidReportDescriptor {
  bool numbered = false;  ///< reports begin with an id
  HidUsage usage;         ///< usage of the first application collection: the kind of device
  std::vector<HidField> fields;
  std::vector<HidUsage> collections;  ///< usages of all collections, in order

  /// Length of a report without its id [byte]; 0 if there is no such report.
  [[nodiscard]] std::uint16_t report_bytes(HidReportType type, std::uint8_t report_id) const noexcept;

  /// First number with the usage `wanted` inside all of the collections `within`, of 1 to 32 bits.
  [[nodiscard]] std::optional<HidElement> element(HidReportType type, const std::vector<HidUsage>& within,
                                                  HidUsage wanted) const;
  /// First number of any usage there.
  [[nodiscard]] std::optional<HidElement> first_element(HidReportType type,
                                                        const std::vector<HidUsage>& within) const;
  /// Number and value that select the usage there: its index in an array, or a bit of its own.
  [[nodiscard]] std::optional<HidOption> option(HidReportType type, const std::vector<HidUsage>& within,
                                                HidUsage wanted) const;

  struct ReportSize {
    HidReportType type;
    std::uint8_t report_id;
    std::uint32_t bits;
  };
  std::vector<ReportSize> sizes;

 private:
  [[nodiscard]] HidElement at(const HidField& field, std::uint32_t index) const noexcept;
};

/// Parses a report descriptor: usages, ranges of them, delimited alternatives (the first counts),
/// collections, push and pop. Throws Error that names `device` and the byte for items that end beyond the
/// last byte, long items, reports over 16 KiB, and all else that Linux refuses.
[[nodiscard]] HidReportDescriptor parse_report_descriptor(std::span<const std::uint8_t> bytes,
                                                          const std::string& device);

/// Extracts the element's number from a report without its id. The report has at least element.report_bytes
/// bytes.
[[nodiscard]] std::int64_t read_element(const HidElement& element,
                                        std::span<const std::uint8_t> report) noexcept;

/// Writes a number to the element; excess high bits are dropped.
void write_element(const HidElement& element, std::int64_t value, std::span<std::uint8_t> report) noexcept;

}  // namespace palpate
