#include "precompute/geometry/material_parts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <map>
#include <set>

#include "base/error.h"
#include "meshes/element.h"

namespace palpate {
namespace {

constexpr Index unclaimed = -1;

std::string entry(const std::string& file, std::size_t part) {
  return fmt::format("{}: [[material]] number {}", file, part + 1);
}

bool is_rest(const MaterialPart& part) {
  return part.regions.empty() && !part.where;
}

/// Text for the centre of an element: "(0.1, 0.2, 0.3) m", in the plane "(0.1, 0.2) m".
std::string place(const Mesh& mesh, Index e) {
  const ElementNodes x = element_nodes(mesh, e);
  const Vec3 centre = x.topRows(traits(mesh.element).corners).colwise().mean().transpose();
  return mesh.dimension() == 3 ? fmt::format("({:.4g}, {:.4g}, {:.4g}) m", centre.x(), centre.y(), centre.z())
                               : fmt::format("({:.4g}, {:.4g}) m", centre.x(), centre.y());
}

std::vector<std::uint8_t> elements_of_regions(const Mesh& mesh, const std::vector<Index>& regions,
                                              const std::string& where) {
  const std::set<Index> present(mesh.regions.begin(), mesh.regions.end());
  for (const Index region : regions) {
    if (!present.contains(region)) {
      throw Error(fmt::format("no element has the region {}", region), where,
                  fmt::format("the body has the regions {}", fmt::join(present, ", ")));
    }
  }
  std::vector<std::uint8_t> marks;
  marks.reserve(mesh.regions.size());
  for (const Index region : mesh.regions) {
    marks.push_back(std::find(regions.begin(), regions.end(), region) != regions.end() ? 1 : 0);
  }
  return marks;
}

[[noreturn]] void fail_overlap(const Mesh& mesh, const std::vector<Index>& owner,
                               const std::vector<std::uint8_t>& marks, std::size_t first, std::size_t part,
                               const std::string& file) {
  const Index other = owner[first];
  std::size_t count = 0;
  for (std::size_t e = first; e < marks.size(); ++e) {
    count += marks[e] != 0 && owner[e] == other ? 1 : 0;
  }
  throw Error(
      fmt::format("overlapping regions: [[material]] number {} and number {} both claim {} elements, the "
                  "first at {}",
                  other + 1, part + 1, count, place(mesh, static_cast<Index>(first))),
      entry(file, part), "make one of them smaller: each element has one material");
}

[[noreturn]] void fail_missing(const Mesh& mesh, const std::vector<Index>& owner, const std::string& file) {
  struct Group {
    Index count, first;
  };
  std::map<Index, Group> groups;  // by region
  for (Index e = 0; e < mesh.elements(); ++e) {
    const auto i = static_cast<std::size_t>(e);
    if (owner[i] == unclaimed) {
      ++groups.try_emplace(mesh.regions[i], Group{0, e}).first->second.count;
    }
  }
  const std::string rest_hint = "one for the rest: without regions, box, half_space, sphere and lowest";
  const bool has_regions = std::adjacent_find(mesh.regions.begin(), mesh.regions.end(),
                                              std::not_equal_to<>()) != mesh.regions.end();
  if (!has_regions) {
    const Group& group = groups.begin()->second;
    throw Error(fmt::format("missing material: no [[material]] claims {} elements, the first at {}",
                            group.count, place(mesh, group.first)),
                file, "add " + rest_hint);
  }
  std::vector<std::string> texts;
  std::vector<Index> regions;
  for (const auto& [region, group] : groups) {
    texts.push_back(fmt::format("{} elements of region {}, the first at {}", group.count, region,
                                place(mesh, group.first)));
    regions.push_back(region);
  }
  throw Error(
      fmt::format("missing material: no [[material]] claims {}", fmt::join(texts, "; ")), file,
      fmt::format("add a [[material]] with regions = [{}], or {}", fmt::join(regions, ", "), rest_hint));
}

}  // namespace

std::vector<Index> materials_of_elements(const Mesh& mesh, const std::vector<MaterialPart>& parts,
                                         const std::string& file) {
  std::vector<Index> owner(static_cast<std::size_t>(mesh.elements()), unclaimed);
  Index rest = unclaimed;
  for (std::size_t part = 0; part < parts.size(); ++part) {
    if (is_rest(parts[part])) {
      rest = static_cast<Index>(part);
      continue;
    }
    const std::vector<std::uint8_t> marks =
        parts[part].where ? select_elements(mesh, *parts[part].where, entry(file, part))
                          : elements_of_regions(mesh, parts[part].regions, entry(file, part));
    for (std::size_t e = 0; e < owner.size(); ++e) {
      if (marks[e] == 0) {
        continue;
      }
      if (owner[e] != unclaimed) {
        fail_overlap(mesh, owner, marks, e, part, file);
      }
      owner[e] = static_cast<Index>(part);
    }
  }
  const bool all_claimed = std::find(owner.begin(), owner.end(), unclaimed) == owner.end();
  if (rest == unclaimed && !all_claimed) {
    fail_missing(mesh, owner, file);
  }
  if (rest != unclaimed && all_claimed) {
    throw Error("the material is for the rest of the body, but the others claim every element",
                entry(file, static_cast<std::size_t>(rest)), "remove it, or make another one smaller");
  }
  std::replace(owner.begin(), owner.end(), unclaimed, rest);
  return owner;
}

}  // namespace palpate
