// A run, watched as a page does.
#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <string>

#include "runtime/igtl/watched_picture.h"

namespace palpate {

/// Connects to the page at `address`, as palpate-runtime prints it, and from then on gives `show` each
/// picture and calls `over` once the run has ended, on the thread of `context`. Throws Error where there is
/// no such page, and from `context` where it sends what is none of its protocol.
void watch(boost::asio::io_context& context, const std::string& address,
           std::function<void(const WatchedPicture&)> show, std::function<void()> over);

}  // namespace palpate
