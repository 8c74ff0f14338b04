// Plays poses through palpate.hpp: as client.c.
#include <algorithm>
#include <chrono>
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <vector>

#include "palpate.hpp"

namespace {

void print(const double (&xyz)[3]) {
  for (const double x : xyz) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &x, sizeof bits);
    std::printf(" %016" PRIx64, bits);
  }
}

}  // namespace

int main(int count, char** words) {
  try {
    palpate_tool tool = palpate::make_tool(0.1);
    tool.friction = 0.3;
    tool.coupling_stiffness = 500.0;
    palpate::Session session(count > 1 ? words[1] : "", tool);
    if (count > 2) session.record(words[2]);
    std::vector<std::int64_t> times;
    palpate_pose pose = palpate::make_pose(0.0, 0.0, 0.0);
    double *p = pose.position, *q = pose.orientation;
    while (std::cin >> p[0] >> p[1] >> p[2] >> q[0] >> q[1] >> q[2] >> q[3] >> pose.grab) {
      const auto begin = std::chrono::steady_clock::now();
      const std::uint32_t status = session.step(pose);
      const palpate_result felt = session.felt();
      std::vector<palpate_contact> touched = session.contacts();
      touched.push_back(PALPATE_CONTACT_INIT);
      times.push_back(std::chrono::nanoseconds(std::chrono::steady_clock::now() - begin).count());
      std::printf("%" PRIu32, status);
      print(felt.force);
      print(felt.torque);
      print(touched[0].position);
      print(touched[0].normal);
      std::printf("\n");
    }
    if (count > 2) session.end_recording();
    std::sort(times.begin(), times.end());
    if (!times.empty())
      std::printf("# %" PRId64 " %" PRId64 "\n", times[times.size() / 2],
                  times[(times.size() - 1) * 999 / 1000]);
  } catch (const palpate::Error& error) {
    std::fprintf(stderr, "error: %s\nhint: %s\n", error.what(), error.hint().c_str());
    return 1;
  }
}
