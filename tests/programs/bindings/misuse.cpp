// A session of palpate.hpp used as it may not be: errors, and never a crash or a wait for ever. Prints "ok".
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <palpate.hpp>
#include <string>
#include <thread>
#include <utility>

namespace {

void expect(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "not so: %s\n", what);
  std::exit(1);
}

template <class Use>
void throws(Use&& use, int code) {
  try {
    use();
  } catch (const palpate::Error& error) {
    expect(error.code() == code && !error.hint().empty(), error.what());
    return;
  }
  expect(false, "no error");
}

}  // namespace

int main(int, char** words) {
  const std::string file = words[1];
  const palpate_tool tool = palpate::make_tool(0.1);
  const palpate_pose pose = palpate::make_pose(0.5, 0.5, 1.2);
  palpate::Session session(file, tool);
  throws([&] { palpate::Session(file + std::string("\0b", 2), tool); }, PALPATE_ERROR_ARGUMENT);
  throws([&] { session.record(std::string("a.mcap\0b", 8)); }, PALPATE_ERROR_ARGUMENT);
  throws([&] { palpate::Recording(std::string("a.mcap\0b", 8)); }, PALPATE_ERROR_ARGUMENT);
  throws([&] { session.record(file); }, PALPATE_ERROR_FILE);
  throws([&] { session.end_recording(); }, PALPATE_ERROR_STATE);

  std::atomic<bool> refused{false};
  const auto step = [&] {
    while (!refused) {
      if ((session.step(pose) & PALPATE_NOT_STEPPED) != 0) refused = true;
    }
  };
  std::thread other(step);
  step();
  other.join();
  expect(session.step(pose) == 0, "one thread steps again");

  palpate::Session moved = std::move(session);
  expect((session.step(pose) & PALPATE_NOT_STEPPED) != 0, "nothing is left of it");  // NOLINT: that is tried
  expect(session.rest().empty() && session.stress().tick == -1 && !session.set_tool(0, tool), "nor seen");
  throws([&] { session.record("a.mcap"); }, PALPATE_ERROR_ARGUMENT);
  expect(moved.step(pose) == 0, "it goes on");
  std::puts("ok");
}
