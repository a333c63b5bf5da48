// A nodelet that publishes its parameter ~step on ~count.
#include <nodelet/nodelet.h>
#include <pluginlib/class_list_macros.hpp>
#include <ros/ros.h>
#include <std_msgs/Int32.h>

namespace counting_nodelet {

class Counter : public nodelet::Nodelet {
  void onInit() override {
    std_msgs::Int32 message;
    message.data = getPrivateNodeHandle().param("step", 1);
    publisher_ = getPrivateNodeHandle().advertise<std_msgs::Int32>("count", 1, true);
    publisher_.publish(message);
  }

  ros::Publisher publisher_;
};

}  // namespace counting_nodelet

PLUGINLIB_EXPORT_CLASS(counting_nodelet::Counter, nodelet::Nodelet)
