#include "precompute/bake_report.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "base/json_text.h"
#include "base/write_file.h"
#include "precompute/machine/blas_kernels.h"

namespace palpate {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const BakeSummary& bake) {
  const Plan& plan = bake.plan;
  Json json = {{"model", bake.model},
               {"output", bake.output.string()},
               {"result", name_of(bake.result)},
               {"nodes", plan.nodes},
               {"elements", plan.elements},
               {"free_dofs", plan.free_dofs},
               {"stored_dofs", plan.stored_dofs},
               {"factor_entries", plan.factor_entries},
               {"block_columns", plan.block_columns},
               {"greens_bytes", plan.file_bytes},
               {"expected_memory_bytes", bake.foretold},
               {"tiles_solved", bake.tiles.solved},
               {"tiles_kept", bake.tiles.kept},
               {"compression", bake.compressed ? "h2" : "none"}};
  if (!bake.fell_back.empty()) json["compression_out_of_reach"] = bake.fell_back;
  if (bake.spread) {
    json["factor_over_ranks"] = {{"expected_bytes", bake.spread->expected},
                                 {"expected_bytes_of_all", bake.spread->expected_all},
                                 {"used_bytes", bake.spread->used},
                                 {"used_bytes_of_all", bake.spread->used_all},
                                 {"work_space_percent", bake.spread->room}};
  }
  if (bake.part) json["part"] = {bake.part->number, bake.part->parts};
  json["stages"] = Json::array();
  for (const Stage& stage : bake.stages)
    json["stages"].push_back({{"name", stage.name}, {"seconds", stage.seconds}});
  return json;
}

}  // namespace

std::string json_text_of(const BakeSummary& bake) {
  return json_text(json_of(bake));
}

std::string name_of(BakeResult result) {
  switch (result) {
    case BakeResult::done:
      return "done";
    case BakeResult::part_done:
      return "part";
    case BakeResult::planned:
      return "planned";
    case BakeResult::interrupted:
      return "interrupted";
  }
  return "";
}

void write_report(const std::filesystem::path& file, const std::vector<std::string>& bakes,
                  const RunFigures& run) {
  Json json = {{"generator", "palpate-precompute " PALPATE_VERSION},
               {"ranks", run.ranks},
               {"jobs", run.jobs},
               {"seconds", run.seconds},
               {"peak_memory_bytes", *std::max_element(run.peak_memory.begin(), run.peak_memory.end())},
               {"rank_memory_bytes", run.peak_memory},
               {"blas_kernels", kernels_in_use().name},
               {"models", Json::array()}};
  if (const std::string note = kernels_in_use().note; !note.empty()) json["blas_note"] = note;
  for (const std::string& bake : bakes) json["models"].push_back(Json::parse(bake));
  const std::string text = json_text(json, 2);
  if (file == "-") {
    std::fputs(text.c_str(), stdout);
  } else {
    write_file(file, text);
  }
}

// getrusage includes the memory of the caller before it started this program.
std::int64_t peak_memory() {
  std::ifstream status("/proc/self/status");
  std::string word;
  while (status >> word && word != "VmHWM:") continue;
  std::int64_t kilobytes = 0;
  status >> kilobytes;
  return 1024 * kilobytes;
}

}  // namespace palpate
