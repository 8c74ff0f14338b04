// What a HID device says of its own reports (USB Device Class Definition for HID 1.11, section 6.2.2).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace palpate {

enum class HidReportType : std::uint8_t { input, output, feature };

/// What a number is for: a page of the HID Usage Tables and a number on it.
struct HidUsage {
  std::uint16_t page = 0;
  std::uint16_t id = 0;
  friend bool operator==(const HidUsage&, const HidUsage&) = default;
};

/// Numbers of one size, one behind the other in a report. Padding is not kept.
struct HidField {
  HidReportType type = HidReportType::input;
  std::uint8_t report_id = 0;
  bool variable = true;     ///< each number has a usage of its own; otherwise each names one of the usages
  std::uint32_t bit = 0;    ///< where the first begins, from behind the report id
  std::uint32_t bits = 0;   ///< of each
  std::uint32_t count = 0;  ///< how many
  std::int64_t logical_min = 0;
  std::int64_t logical_max = 0;
  std::vector<HidUsage> usages;       ///< variable: of number k the k-th, or the last; otherwise the choice
  std::vector<HidUsage> collections;  ///< that it lies in, from the outermost
};

/// One number in a report.
struct HidElement {
  HidReportType type = HidReportType::input;
  std::uint8_t report_id = 0;
  std::uint16_t report_bytes = 0;  ///< of the whole report, behind the report id
  std::uint32_t bit = 0;           ///< from behind the report id
  std::uint32_t bits = 0;          ///< 1 to 32
  std::int64_t logical_min = 0;
  std::int64_t logical_max = 0;
};

/// A number and the value of it that means some usage.
struct HidOption {
  HidElement element;
  std::int64_t value = 0;
};

/// A report descriptor, read.
struct HidReportDescriptor {
  bool numbered = false;  ///< reports begin with their id
  HidUsage usage;         ///< of the first application collection: what the device is
  std::vector<HidField> fields;
  std::vector<HidUsage> collections;  ///< usages of all of them, as they begin

  /// Length of a report behind its id [byte]; 0 where there is none such.
  [[nodiscard]] std::uint16_t report_bytes(HidReportType type, std::uint8_t report_id) const noexcept;

  /// The first number of the usage that lies in all of the collections, and has 1 to 32 bits.
  [[nodiscard]] std::optional<HidElement> element(HidReportType type, const std::vector<HidUsage>& within,
                                                  HidUsage wanted) const;
  /// The first number of any usage there.
  [[nodiscard]] std::optional<HidElement> first_element(HidReportType type,
                                                        const std::vector<HidUsage>& within) const;
  /// How the usage is chosen there: by its place in a list (an array), or by a bit of its own.
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

/// Reads a report descriptor. Usages, ranges of them, delimited alternatives (the first counts), collections,
/// push and pop. Throws Error that names `device` and the byte: items that end behind the last byte, long
/// items, reports beyond 16 KiB, and whatever else Linux refuses too.
[[nodiscard]] HidReportDescriptor parse_report_descriptor(std::span<const std::uint8_t> bytes,
                                                          const std::string& device);

/// The element's number in a report without its id. The report has at least element.report_bytes bytes.
[[nodiscard]] std::int64_t read_element(const HidElement& element,
                                        std::span<const std::uint8_t> report) noexcept;

/// Puts a number there, as many of its low bits as there is room for.
void write_element(const HidElement& element, std::int64_t value, std::span<std::uint8_t> report) noexcept;

}  // namespace palpate
