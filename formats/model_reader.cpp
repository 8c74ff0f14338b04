#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <type_traits>
#include <utility>

#include "base/error.h"
#include "base/file_io.h"
#include "base/memory.h"
#include "base/printable.h"
#include "formats/begun_model.h"
#include "formats/checksum.h"
#include "formats/content_hash.h"
#include "formats/contents.h"
#include "formats/dynamics_fields.h"
#include "formats/hierarchical_fields.h"
#include "formats/mcap/records.h"
#include "formats/model_check.h"
#include "formats/model_fields.h"
#include "formats/model_file.h"
#include "formats/precision_fields.h"

namespace palpate {
namespace {

class Reader {
 public:
  Reader(const Contents& file, const LoadOptions& options)
      : file_(file), options_(options), where_(file.path().string()), counts_(where_) {}

  Model read();
  BegunModel read_begun();
  Model read_outline();

 private:
  void read_known();
  void read_body();
  template <class T>
  void read_attribute(const Attribute<T>& attribute);
  template <class T>
  void read_field(const Field<T>& field);
  [[nodiscard]] PackedGreens read_packed(const std::string& path, std::shared_ptr<const SmoothPart> smooth);
  void read_compressed();
  void check_diagonal(const std::string& path, std::int64_t i, double entry) const;
  [[nodiscard]] std::shared_ptr<const void> read_scalars(const std::string& path, const Stored& stored,
                                                         bool single);
  [[nodiscard]] std::shared_ptr<std::byte> room_for(const Stored& packed) const;
  void check_content(const std::vector<std::int64_t>& version);
  void check_stored_checksum(const std::string& path, const std::string& found);
  template <class T>
  ChunkedChecksum::Inspect first_not_finite(std::atomic<std::size_t>& first) const;

  const Contents& file_;
  LoadOptions options_;
  std::string where_;
  Counts counts_;
  FileHeader header_;
  ContentHash content_;
  Model model_;
};

Model Reader::read() {
  const std::vector<std::int64_t> version = format_version(file_);
  read_known();
  for_each_probe_field(model_.mesh.element, [this](const auto& field) { read_field(field); });
  check_model(model_, where_);
  check_precision(model_, header_.precision, where_);
  if (model_.scope == Scope::none) {
    model_.greens = {};
  } else if (file_.has(tree_path)) {
    read_compressed();
  } else {
    model_.greens = read_packed(greens_path, model_.greens.smooth());
  }
  if (model_.dynamics.method == DynamicsMethod::packed)
    model_.dynamics.inverse = read_packed(inverse_path, model_.dynamics.inverse.smooth());
  check_content(version);
  return std::move(model_);
}

BegunModel Reader::read_begun() {
  format_version(file_);
  read_known();
  return {std::move(model_), header_.precision, file_.has(greens_path)};
}

Model Reader::read_outline() {
  format_version(file_);
  read_body();
  return std::move(model_);
}

void Reader::read_body() {
  for_each_attribute([this](const auto& attribute) { read_attribute(attribute); });
  if (model_.scope == Scope::none) counts_.allow_none_stored();
  for_each_body_field(model_.mesh.element, [this](const auto& field) { read_field(field); });
}

/// Reads everything before the Green's functions.
void Reader::read_known() {
  read_body();
  if (model_.scope == Scope::none && (file_.has(overlay_group) || file_.has(dynamics_group)))
    refuse(where_, "the scope is none, but there are overlays or dynamics");
  if (file_.has(overlay_group)) {
    for_each_overlay_field([this](const auto& field) { read_field(field); });
    if (model_.overlay.refinement == 0) refuse(where_, "/overlay/refinement is 0");
  }
  if (file_.has(dynamics_group))
    for_each_dynamics_field(model_, [this](const auto& field) { read_field(field); });
  if (header_.precision == Precision::split_precision && model_.scope != Scope::none)
    for_each_smooth_field(model_, [this](const auto& field) { read_field(field); });
  if (file_.has(greens_errors_path)) visit_greens_errors([this](const auto& field) { read_field(field); });
  if (model_.dynamics.method == DynamicsMethod::packed && file_.has(inverse_errors_path))
    visit_inverse_errors([this](const auto& field) { read_field(field); });
}

template <class T>
void Reader::read_attribute(const Attribute<T>& attribute) {
  const std::string name = std::string("the attribute ") + attribute.name;
  std::optional<T> value;
  if constexpr (std::is_same_v<T, std::string>) {
    value = file_.text_attribute("/", attribute.name);
  } else if (const auto values = file_.integer_attribute("/", attribute.name, 1)) {
    value = values->front();
  }
  if (!value) refuse(where_, name + " is missing");
  if (attribute.put == nullptr) {
    if (*value != attribute.take(model_, header_)) refuse(where_, name + " has an unknown value");
    return;
  }
  try {
    attribute.put(model_, header_, *value);
  } catch (const Unreadable& wrong) {
    refuse(where_, name + " " + wrong.what);
  }
}

template <class T>
void Reader::read_field(const Field<T>& field) {
  const Stored stored = file_.locate(field.path, number_type<T>(), field.shape.size());
  counts_.match(field.path, field.shape, stored.dims);

  std::vector<T> values(static_cast<std::size_t>(stored.bytes) / sizeof(T));
  read_exactly(file_.file(), std::as_writable_bytes(std::span(values)), stored.offset);
  ChunkedChecksum found;
  found.append(std::as_bytes(std::span(values)));
  check_stored_checksum(field.path, found.digits());
  check_values(field, values, counts_);
  if (field.put == nullptr) {
    const std::vector<T> expected = field.take(model_);
    const auto differs = std::mismatch(values.begin(), values.end(), expected.begin()).first - values.begin();
    if (static_cast<std::size_t>(differs) < values.size()) {
      refuse(where_, std::string(field.path) + " holds " +
                         std::to_string(values[static_cast<std::size_t>(differs)]) + " (entry " +
                         std::to_string(differs) + "), " +
                         std::to_string(expected[static_cast<std::size_t>(differs)]) + " is expected");
    }
    return;
  }
  try {
    field.put(model_, values);
  } catch (const Unreadable& wrong) {
    refuse(where_, std::string(field.path) + " " + wrong.what);
  }
}

void Reader::check_stored_checksum(const std::string& path, const std::string& found) {
  const auto stored = file_.text_attribute(path, "xxh3");
  if (!stored) refuse(where_, path + " has no checksum");
  if (*stored != found) refuse(where_, path + " was altered: its checksum is " + found + ", not " + *stored);
  content_.add_dataset(path, found);
}

template <class T>
ChunkedChecksum::Inspect Reader::first_not_finite(std::atomic<std::size_t>& first) const {
  using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
  constexpr Bits exponent = sizeof(T) == 4 ? Bits{0x7f800000U} : static_cast<Bits>(0x7ff0000000000000U);
  return [&first](std::size_t at, std::span<const std::byte> block) {
    const auto* values = static_cast<const Bits*>(static_cast<const void*>(block.data()));
    const std::size_t count = block.size() / sizeof(Bits);
    unsigned found = 0;
    for (std::size_t i = 0; i < count; ++i)
      found |= static_cast<unsigned>((values[i] & exponent) == exponent);
    if (found == 0) return;
    const auto* bad = std::find_if(values, values + count, [](Bits v) { return (v & exponent) == exponent; });
    const std::size_t entry = at / sizeof(Bits) + static_cast<std::size_t>(bad - values);
    for (std::size_t seen = first; entry < seen && !first.compare_exchange_weak(seen, entry);) {
    }
  };
}

/// Memory for a packed matrix; null if it is larger than the limit.
std::shared_ptr<std::byte> Reader::room_for(const Stored& packed) const {
  const std::int64_t most = options_.most_in_memory < 0 ? available_memory() / 2 : options_.most_in_memory;
  const std::shared_ptr<void> memory = packed.bytes <= most ? map_memory(packed.bytes) : nullptr;
  return {memory, static_cast<std::byte*>(memory.get())};
}

/// Checks that a dof's own compliance is positive, or zero if the dof is held.
void Reader::check_diagonal(const std::string& path, std::int64_t i, double entry) const {
  const Index node = model_.stored_nodes[static_cast<std::size_t>(i / model_.dimension())];
  const bool held = (model_.fixed[static_cast<std::size_t>(node)] >> i % model_.dimension() & 1) != 0;
  if (held ? entry != 0.0 : !(entry > 0.0) || std::isinf(entry))
    refuse(where_, path + ": diagonal entry " + std::to_string(i) + " is not " +
                       (held ? "zero, though its dof is held" : "positive"));
}

/// Reads or maps an array of float or double and checks its checksum and that all values are finite.
std::shared_ptr<const void> Reader::read_scalars(const std::string& path, const Stored& stored, bool single) {
  if (stored.offset % (single ? 4 : 8) != 0)
    refuse(where_, path + " does not start at a multiple of its scalar's size");
  constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
  std::atomic<std::size_t> bad{none};
  ChunkedChecksum found;
  const std::shared_ptr<std::byte> memory = room_for(stored);
  found.append_file(file_.file(), stored.offset, stored.bytes, memory.get(),
                    single ? first_not_finite<float>(bad) : first_not_finite<double>(bad));
  check_stored_checksum(path, found.digits());
  if (bad != none)
    refuse(where_, path + " holds a value that is not finite (entry " + std::to_string(bad) + ")");

  if (memory != nullptr) return memory;
  return map_file(file_.file(), stored.offset, stored.bytes);
}

/// Reads Green's functions in nested low-rank form.
void Reader::read_compressed() {
  for_each_tree_field([this](const auto& field) { read_field(field); });
  check_tree(model_, where_);
  for_each_rank_field([this](const auto& field) { read_field(field); });
  check_ranks(model_, where_);
  HierarchicalMatrix& matrix = compressed_to_fill(model_);
  matrix.index();
  for (const CompressedArray& array : compressed_arrays) {
    const Stored stored = file_.locate(array.path, number_type<float>(), 1);
    if (const std::int64_t entries = (matrix.*array.at).back(); stored.dims[0] != entries)
      refuse(where_, std::string(array.path) + " has " + std::to_string(stored.dims[0]) + " entries, " +
                         std::to_string(entries) + " are expected by pairs and ranks");
    const std::shared_ptr<const void> scalars = read_scalars(array.path, stored, true);
    matrix.*array.data = std::shared_ptr<const float[]>(scalars, static_cast<const float*>(scalars.get()));
  }
  for (std::size_t p = 0; p < matrix.near_pair.size(); ++p) {
    const auto [row, column] = matrix.near_pair[p];
    if (row != column) continue;
    const float* entries = matrix.near.get() + matrix.near_at[p];
    const std::int64_t first = std::int64_t{matrix.dimension} * matrix.tree.begin(row),
                       count = std::int64_t{matrix.dimension} * matrix.tree.end(row) - first;
    for (std::int64_t i = 0; i < count; ++i)
      check_diagonal(near_path, first + i, static_cast<double>(entries[i * (count + 1)]));
  }
}

/// Reads or maps a packed matrix of the stored dofs and checks its values.
PackedGreens Reader::read_packed(const std::string& path, std::shared_ptr<const SmoothPart> smooth) {
  const std::int64_t order = model_.stored_dofs();
  const bool single = has_float_entries(header_.precision);
  const Stored stored = file_.locate(path, single ? number_type<float>() : number_type<double>(), 1);
  if (stored.dims[0] != packed_size(order))
    refuse(where_, path + " has " + std::to_string(stored.dims[0]) + " entries, " +
                       std::to_string(packed_size(order)) + " are expected by /dofs/stored_nodes");

  PackedGreens matrix(read_scalars(path, stored, single), order, header_.precision, std::move(smooth));
  for (std::int64_t i = 0; i < order; ++i) check_diagonal(path, i, matrix(i, i));
  return matrix;
}

/// Checks the content hash. Every dataset matches its own checksum by now; the attributes remain.
void Reader::check_content(const std::vector<std::int64_t>& version) {
  const auto stored = file_.text_attribute("/", "content_hash");
  if (!stored) refuse(where_, "the attribute content_hash is missing: the file was not finished");
  model_.content_hash = *stored;
  if (version[1] > format_minor) return;  // its hash covers fields unknown here
  add_attributes(content_, model_, header_, version);
  if (content_.digits() != *stored)
    refuse(where_, "an attribute of the file or a checksum was altered: content_hash is " + *stored +
                       ", not " + content_.digits());
}

}  // namespace

std::vector<std::int64_t> format_version(const Contents& file) {
  const std::string where = file.path().string();
  if (file.text_attribute("/", "format") != "palpate")
    throw Error("is not a Palpate file with a model", where,
                "Give a NAME.palpate.hdf that palpate-precompute has written");
  const auto version = file.integer_attribute("/", "version", 2);
  if (!version) refuse(where, "the attribute version is missing");
  if ((*version)[0] != format_major) {
    throw Error("the file has format version " + std::to_string((*version)[0]) + "." +
                    std::to_string((*version)[1]) + ", this program reads version " +
                    std::to_string(format_major) + ".x",
                where, "Precompute it again with this program's palpate-precompute");
  }
  if ((*version)[1] < 0) refuse(where, "the attribute version is negative");
  return *version;
}

std::optional<BegunModel> read_begun_model(const std::filesystem::path& partial) {
  std::error_code missing;
  if (!std::filesystem::is_regular_file(std::filesystem::symlink_status(partial, missing))) return {};
  try {
    return Reader(Contents::read(partial), {}).read_begun();
  } catch (const Error&) {
    return {};  // it starts from the beginning
  }
}

namespace {

Contents contents_of(const std::filesystem::path& path) {
  FileDescriptor bytes = open_file(path, OpenMode::read);
  std::string start(mcap::magic.size(), '\0');
  start.resize(read_some(bytes, std::as_writable_bytes(std::span(start)), 0));
  if (start == mcap::magic) {
    throw Error(
        "is a recording, not a model", path.string(),
        "palpate-runtime view " + shell_word(path.string()) + " shows it; a model is a NAME.palpate.hdf");
  }
  return Contents::read(std::move(bytes));
}

}  // namespace

Model load_model(const std::filesystem::path& path, const LoadOptions& options) {
  return Reader(contents_of(path), options).read();
}

Model load_outline(const std::filesystem::path& path) {
  return Reader(contents_of(path), {}).read_outline();
}

std::string stored_content_hash(const std::filesystem::path& path) {
  try {
    return contents_of(path).text_attribute("/", "content_hash").value_or("");
  } catch (const Error&) {
    return "";
  }
}

}  // namespace palpate
