// The same in C++17: owners in place of calls to create and destroy, exceptions in place of codes.
#include <chrono>
#include <cstdio>
#include <palpate.hpp>
#include <thread>

int main() try {
  palpate::Session session("block.palpate.hdf", palpate::make_tool(0.01));
  session.record("loop.mcap");
  auto due = std::chrono::steady_clock::now();
  for (int tick = 0; tick <= 420; ++tick) {
    std::this_thread::sleep_until(due += std::chrono::milliseconds(1));
    session.step(palpate::make_pose(0.03, 0.03, 0.0402 - 0.00001 * tick));
    const palpate_result felt = session.felt();
    if (tick % 70 == 0) std::printf("%3d ms: %.6f N, %d contacts\n", tick, felt.force[2], felt.contacts);
  }
  for (const palpate_contact& contact : session.contacts())
    std::printf("pressed at %.4f %.4f %.4f\n", contact.position[0], contact.position[1], contact.position[2]);
  session.end_recording();
} catch (const palpate::Error& error) {
  std::fprintf(stderr, "%s: %s\n", error.what(), error.hint().c_str());
  return 1;
}
