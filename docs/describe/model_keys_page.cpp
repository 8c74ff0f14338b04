// The page of model.toml's keys.
#include <fmt/format.h>

#include <algorithm>

#include "docs/describe/markdown.h"
#include "docs/describe/pages.h"
#include "meshes/material_fields.h"
#include "precompute/description/description_keys.h"
#include "precompute/description/description_parts.h"

namespace palpate {
namespace {

using Rows = std::vector<std::vector<std::string>>;

const KeyTable& table(std::string_view title) {
  return *std::ranges::find(key_tables(), title, &KeyTable::title);
}

std::vector<std::string> row_of(const ModelKey& key) {
  return {code(std::string(key.key)), std::string(key.unit), key.otherwise, key.meaning};
}

std::string keys(std::string_view title) {
  Rows rows;
  std::ranges::transform(table(title).keys, std::back_inserter(rows), row_of);
  return markdown_table({"key", "unit", "default", "meaning"}, rows);
}

std::string section(std::string_view title, const std::string& about) {
  return fmt::format("## `{}`\n\n{}\n\n{}", title, about, keys(title));
}

std::string subsection(std::string_view title, std::string_view key) {
  return fmt::format("### `{}`\n\n{}", key, keys(title));
}

std::string comma_code(const Keys& words) {
  std::string text;
  for (const std::string_view word : words) text += fmt::format("{}`\"{}\"`", text.empty() ? "" : ", ", word);
  return text;
}

/// Elements and meshers of each kind of geometry, the usual one first.
std::string kinds_table() {
  Rows rows;
  for (const std::string_view kind : alternatives_of("[geometry]")) {
    const std::string usual = kind == "volume" ? " (usual: as in the file)" : "";
    rows.push_back(
        {code(std::string(kind)), comma_code(elements_of(kind)) + usual, comma_code(meshers_of(kind))});
  }
  return markdown_table({"geometry", "elements, the usual one first", "meshers, the usual one first"}, rows);
}

/// What a key of [mesh] applies to: "all", or kinds of geometry, with the mesher where the other one hasn't
/// the key.
std::string applies_to(std::string_view key) {
  std::string text;
  bool all = true;
  for (const std::string_view kind : alternatives_of("[geometry]")) {
    const Keys meshers = meshers_of(kind).empty() ? Keys{""} : meshers_of(kind);
    std::string with;
    std::size_t fitting = 0;
    for (const std::string_view mesher : meshers) {
      const Keys fit = mesh_keys_of(kind, mesher);
      if (std::ranges::find(fit, key) == fit.end()) continue;
      with = mesher;
      ++fitting;
    }
    all = all && fitting == meshers.size();
    if (fitting == 0) continue;
    text += fmt::format("{}`{}`{}", text.empty() ? "" : ", ", kind,
                        fitting < meshers.size() ? " by " + with : "");
  }
  return all ? "all" : text;
}

std::string mesh_keys() {
  Rows rows;
  for (const ModelKey& key : table("[mesh]").keys) {
    rows.push_back(row_of(key));
    rows.back().insert(rows.back().begin() + 1, applies_to(key.key));
  }
  return markdown_table({"key", "for", "unit", "default", "meaning"}, rows);
}

std::string material_constants() {
  Rows rows;
  for_each_material_field(Material{}, [&](const MaterialField& field, std::span<const double> values) {
    const std::string otherwise = field.required ? "required" : values.size() > 1 ? "none" : shown(values[0]);
    const std::string unit = field.unit == "kg/m^3" ? "kg/m³" : std::string(field.unit);
    rows.push_back({code(std::string(field.key)), unit, otherwise, std::string(field.meaning)});
  });
  return markdown_table({"key", "unit", "default", "meaning"}, rows);
}

std::string first_part() {
  std::string text =
      "# Keys of model.toml\n\n"
      "Every key that `palpate-precompute` reads. Any other key is an error that names the nearest known "
      "one. "
      "Units are SI throughout. A vector has three numbers in space and two in the plane. How to write a "
      "model, "
      "with examples: [model.toml](../model-toml.md).\n\n"
      "## Top level\n\n" +
      keys("");
  text += section("[geometry]",
                  "Exactly one of the first nine keys. Paths are relative to the folder of `model.toml`.");
  for (const char* shape : {"box", "rectangle", "cylinder", "sphere", "polygon"})
    text += subsection(std::string("[geometry] ") + shape, std::string(shape) + " = {...}");
  text += "## `[mesh]`\n\nHow the inside is filled. The kind of geometry decides what can be chosen:\n\n" +
          kinds_table() + mesh_keys();
  return text;
}

}  // namespace

Page model_keys_page() {
  std::string text = first_part();
  text += "## `[material]`, or several `[[material]]`\n\n" + material_constants();
  text +=
      "Where there are several, each says which elements it is for by at most one of these keys. The one "
      "that "
      "has none of them takes all other elements. Every element must have exactly one material. Where a "
      "material has `regions`, the labels of an image are meshed apart.\n\n" +
      keys("[material]");
  text += section(
      "[[fixed]]",
      "One or more regions that are held. Each has exactly one selection (below). Regions may overlap "
      "where they agree on the displacement.");
  text += section("[[load]]",
                  "What acts all the time, any number. Each has exactly one of these keys and, except for "
                  "`gravity`, one selection.");
  text +=
      "## Selections\n\nOne of these in each `[[fixed]]`, `[[load]]` and `[[overlay.region]]`, at most one "
      "in "
      "`[warp]`. Positions are "
      "those of the scaled geometry, in metres.\n\n" +
      keys(selection_title);
  text += section("[storage]",
                  "What the baked file keeps. What `precision` means: "
                  "[stored precision](../model-toml.md#stored-precision).");
  text += section("[overlay]",
                  "Overlays that are condensed offline and kept in the file. "
                  "See [overlays](../overlays.md).");
  text += section("[dynamics]", "Free vibration after the body was let go. See [dynamics](../dynamics.md).");
  text += subsection("[dynamics] damping", "damping = {...}");
  text += section(
      "[warp]",
      "A study of how far the body may turn, kept in the file. The table may be empty; besides these "
      "keys it takes a selection of what is loaded, by default the end farthest from what is held. See "
      "[warping](../warp.md#the-range-of-a-body).");
  return {"model-keys", text};
}

}  // namespace palpate
