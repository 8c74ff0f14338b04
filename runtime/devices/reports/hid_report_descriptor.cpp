#include "runtime/devices/reports/hid_report_descriptor.h"

#include <algorithm>
#include <array>

#include "base/error.h"

namespace palpate {
namespace {

// Bounds of Linux (include/linux/hid.h), which refuses larger devices itself.
constexpr std::size_t largest_descriptor = 4096;     // bytes
constexpr std::uint32_t largest_report = 8 * 16384;  // bits
constexpr std::uint32_t largest_element = 256;       // bits
constexpr std::uint32_t most_usages = 12288;
constexpr std::size_t deepest = 64;  // collections, pushed states

/// Item prefixes of sections 6.2.2.4 (main), 6.2.2.7 (global) and 6.2.2.8 (local): tag and type, without the
/// size.
enum Item : std::uint8_t {
  input_item = 0x80,
  output_item = 0x90,
  feature_item = 0xB0,
  collection_item = 0xA0,
  end_collection_item = 0xC0,
  usage_page_item = 0x04,
  logical_minimum_item = 0x14,
  logical_maximum_item = 0x24,
  report_size_item = 0x74,
  report_id_item = 0x84,
  report_count_item = 0x94,
  push_item = 0xA4,
  pop_item = 0xB4,
  usage_item = 0x08,
  usage_minimum_item = 0x18,
  usage_maximum_item = 0x28,
  delimiter_item = 0xA8,
};
constexpr std::uint8_t long_item = 0xFE;
constexpr std::uint32_t application_collection = 1;
constexpr std::uint32_t constant_flag = 1;
constexpr std::uint32_t variable_flag = 2;

/// Data of an item: 0, 1, 2 or 4 bytes.
struct Data {
  std::uint32_t bits = 0;
  std::size_t size = 0;

  [[nodiscard]] std::int64_t as_signed() const noexcept {
    if (size == 1) return static_cast<std::int8_t>(bits);
    if (size == 2) return static_cast<std::int16_t>(bits);
    return static_cast<std::int32_t>(bits);
  }
};

struct Globals {
  std::uint16_t page = 0;
  Data minimum, maximum;
  std::uint32_t size = 0, count = 0;
  std::uint8_t id = 0;
};

/// Range of usages, first to last; without a page of their own they take that of the main item.
struct UsageRange {
  Data first, last;
};

struct Locals {
  std::vector<UsageRange> usages;
  std::optional<Data> minimum, maximum;
  bool delimited = false, taken = false;
};

class Parser {
 public:
  explicit Parser(const std::string& device) : device_(device) {}

  HidReportDescriptor parse(std::span<const std::uint8_t> bytes) {
    if (bytes.empty()) fail("the report descriptor is empty");
    if (bytes.size() > largest_descriptor) {
      fail("the report descriptor has " + std::to_string(bytes.size()) + " bytes, more than " +
           std::to_string(largest_descriptor));
    }
    while (at_ < bytes.size()) {
      const std::uint8_t prefix = bytes[at_];
      if (prefix == long_item) fail("a long item, which no device uses");
      const std::size_t size = (prefix & 3U) == 3U ? 4 : prefix & 3U;
      if (bytes.size() - at_ < 1 + size) fail("the last item is cut off");
      Data data{0, size};
      for (std::size_t i = 0; i < size; ++i) {
        data.bits |= static_cast<std::uint32_t>(bytes[at_ + 1 + i]) << (8 * i);
      }
      item(static_cast<std::uint8_t>(prefix & 0xFCU), data);
      at_ += 1 + size;
    }
    if (!collections_.empty()) fail("a collection is not ended");
    return std::move(result_);
  }

 private:
  void item(std::uint8_t tag, Data data) {
    switch (tag) {
      case input_item:
        return add_field(HidReportType::input, data.bits);
      case output_item:
        return add_field(HidReportType::output, data.bits);
      case feature_item:
        return add_field(HidReportType::feature, data.bits);
      case collection_item:
        return begin_collection(data.bits);
      case end_collection_item:
        if (collections_.empty()) fail("a collection is ended that was not begun");
        collections_.pop_back();
        locals_ = {};
        return;
      case usage_item:
        return add_usage({data, data});
      case usage_minimum_item:
        locals_.minimum = data;
        return add_range();
      case usage_maximum_item:
        locals_.maximum = data;
        return add_range();
      case delimiter_item:
        locals_.delimited = data.bits == 1;
        locals_.taken = false;
        return;
      default:
        return global_item(tag, data);
    }
  }

  /// Applies an item that holds until the next of its kind.
  void global_item(std::uint8_t tag, Data data) {
    switch (tag) {
      case usage_page_item:
        globals_.page = static_cast<std::uint16_t>(data.bits);
        return;
      case logical_minimum_item:
        globals_.minimum = data;
        return;
      case logical_maximum_item:
        globals_.maximum = data;
        return;
      case report_size_item:
        if (data.bits > largest_element) fail("numbers of " + std::to_string(data.bits) + " bits");
        globals_.size = data.bits;
        return;
      case report_id_item:
        if (data.bits == 0 || data.bits > 255) fail("report id " + std::to_string(data.bits));
        globals_.id = static_cast<std::uint8_t>(data.bits);
        result_.numbered = true;
        return;
      case report_count_item:
        if (data.bits > largest_report) fail(std::to_string(data.bits) + " numbers in a report");
        globals_.count = data.bits;
        return;
      case push_item:
        if (pushed_.size() == deepest) fail("more than " + std::to_string(deepest) + " states are pushed");
        pushed_.push_back(globals_);
        return;
      case pop_item:
        if (pushed_.empty()) fail("a state is popped that was not pushed");
        globals_ = pushed_.back();
        pushed_.pop_back();
        return;
      default:
        return;  // physical range, unit, designators, strings, and additions of later versions
    }
  }

  void add_usage(const UsageRange& range) {
    if (locals_.delimited && locals_.taken) return;
    locals_.taken = true;
    locals_.usages.push_back(range);
  }

  void add_range() {
    if (!locals_.minimum || !locals_.maximum) return;
    add_usage({*locals_.minimum, *locals_.maximum});
    locals_.minimum.reset();
    locals_.maximum.reset();
  }

  [[nodiscard]] HidUsage as_usage(const Data& data, std::uint32_t offset) const noexcept {
    const std::uint32_t bits = data.bits + offset;
    return {data.size == 4 ? static_cast<std::uint16_t>(bits >> 16) : globals_.page,
            static_cast<std::uint16_t>(bits)};
  }

  [[nodiscard]] std::vector<HidUsage> usages() const {
    std::vector<HidUsage> result;
    for (const UsageRange& range : locals_.usages) {
      if (range.last.bits < range.first.bits) fail("a range of usages that ends before it begins");
      const std::uint32_t more = range.last.bits - range.first.bits;
      if (more >= most_usages || result.size() + more >= most_usages) fail("too many usages");
      for (std::uint32_t offset = 0; offset <= more; ++offset) {
        result.push_back(as_usage(range.first, offset));
      }
    }
    return result;
  }

  void begin_collection(std::uint32_t kind) {
    if (collections_.size() == deepest) fail("collections are nested too deep");
    const std::vector<HidUsage> given = usages();
    collections_.push_back(given.empty() ? HidUsage{} : given.front());
    result_.collections.push_back(collections_.back());
    if (kind == application_collection && result_.usage == HidUsage{}) result_.usage = collections_.back();
    locals_ = {};
  }

  void add_field(HidReportType type, std::uint32_t flags) {
    HidField field;
    field.type = type;
    field.report_id = globals_.id;
    field.variable = (flags & variable_flag) != 0;
    field.bits = globals_.size;
    field.count = globals_.count;
    field.logical_min = globals_.minimum.as_signed();
    // Devices write 25 FF for 255: if the minimum is not negative, neither is the maximum.
    field.logical_max = field.logical_min < 0 ? globals_.maximum.as_signed() : globals_.maximum.bits;
    field.usages = usages();
    field.collections = collections_;
    locals_ = {};

    std::uint32_t& used = bits_of(type, globals_.id);
    field.bit = used;
    const std::uint64_t all = std::uint64_t{field.bits} * field.count;
    if (all > largest_report - used) fail("a report longer than 16 KiB");
    used += static_cast<std::uint32_t>(all);
    if ((flags & constant_flag) != 0 || all == 0 || field.usages.empty()) return;  // padding
    if (field.logical_max < field.logical_min) {
      fail("a logical maximum of " + std::to_string(field.logical_max) + " under the minimum of " +
           std::to_string(field.logical_min));
    }
    result_.fields.push_back(std::move(field));
  }

  std::uint32_t& bits_of(HidReportType type, std::uint8_t id) {
    for (auto& size : result_.sizes) {
      if (size.type == type && size.report_id == id) return size.bits;
    }
    result_.sizes.push_back({type, id, 0});
    return result_.sizes.back().bits;
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(what, device_ + ", byte " + std::to_string(at_) + " of its report descriptor",
                "this is the device's own firmware; see whether its maker has a newer one");
  }

  const std::string& device_;
  std::size_t at_ = 0;
  Globals globals_;
  Locals locals_;
  std::vector<Globals> pushed_;
  std::vector<HidUsage> collections_;
  HidReportDescriptor result_;
};

bool lies_in(const HidField& field, const std::vector<HidUsage>& within) noexcept {
  return std::all_of(within.begin(), within.end(), [&](const HidUsage& usage) {
    return std::find(field.collections.begin(), field.collections.end(), usage) != field.collections.end();
  });
}

bool is_usable(const HidField& field) noexcept {
  return field.bits >= 1 && field.bits <= 32;
}

/// Returns the index of the usage in the field, if it has one.
std::optional<std::uint32_t> place_of(const HidField& field, HidUsage usage) noexcept {
  const auto found = std::find(field.usages.begin(), field.usages.end(), usage);
  if (found == field.usages.end()) return std::nullopt;
  return static_cast<std::uint32_t>(found - field.usages.begin());
}

}  // namespace

HidReportDescriptor parse_report_descriptor(std::span<const std::uint8_t> bytes, const std::string& device) {
  return Parser(device).parse(bytes);
}

std::uint16_t HidReportDescriptor::report_bytes(HidReportType type, std::uint8_t report_id) const noexcept {
  for (const ReportSize& size : sizes) {
    if (size.type == type && size.report_id == report_id)
      return static_cast<std::uint16_t>((size.bits + 7) / 8);
  }
  return 0;
}

HidElement HidReportDescriptor::at(const HidField& field, std::uint32_t index) const noexcept {
  return {field.type,
          field.report_id,
          report_bytes(field.type, field.report_id),
          field.bit + index * field.bits,
          field.bits,
          field.logical_min,
          field.logical_max};
}

std::optional<HidElement> HidReportDescriptor::element(HidReportType type,
                                                       const std::vector<HidUsage>& within,
                                                       HidUsage wanted) const {
  for (const HidField& field : fields) {
    if (field.type != type || !field.variable || !is_usable(field) || !lies_in(field, within)) continue;
    const auto place = place_of(field, wanted);
    if (place && *place < field.count) return at(field, *place);
  }
  return std::nullopt;
}

std::optional<HidElement> HidReportDescriptor::first_element(HidReportType type,
                                                             const std::vector<HidUsage>& within) const {
  for (const HidField& field : fields) {
    if (field.type == type && is_usable(field) && lies_in(field, within)) return at(field, 0);
  }
  return std::nullopt;
}

std::optional<HidOption> HidReportDescriptor::option(HidReportType type, const std::vector<HidUsage>& within,
                                                     HidUsage wanted) const {
  for (const HidField& field : fields) {
    if (field.type != type || !is_usable(field) || !lies_in(field, within)) continue;
    const auto place = place_of(field, wanted);
    if (!place) continue;
    if (!field.variable) return HidOption{at(field, 0), field.logical_min + *place};
    if (*place < field.count) return HidOption{at(field, *place), 1};
  }
  return std::nullopt;
}

std::int64_t read_element(const HidElement& element, std::span<const std::uint8_t> report) noexcept {
  if (element.bits == 0) return 0;
  std::uint64_t value = 0;
  for (std::uint32_t i = 0; i < element.bits; ++i) {
    const std::uint32_t bit = element.bit + i;
    value |= static_cast<std::uint64_t>((report[bit / 8] >> (bit % 8)) & 1U) << i;
  }
  const std::uint64_t sign = std::uint64_t{1} << (element.bits - 1);
  if (element.logical_min < 0 && (value & sign) != 0) value |= ~(sign | (sign - 1));
  return static_cast<std::int64_t>(value);
}

void write_element(const HidElement& element, std::int64_t value, std::span<std::uint8_t> report) noexcept {
  for (std::uint32_t i = 0; i < element.bits; ++i) {
    const std::uint32_t bit = element.bit + i;
    const auto mask = static_cast<std::uint8_t>(1U << (bit % 8));
    const bool set = ((static_cast<std::uint64_t>(value) >> i) & 1U) != 0;
    report[bit / 8] = static_cast<std::uint8_t>(set ? report[bit / 8] | mask : report[bit / 8] & ~mask);
  }
}

}  // namespace palpate
