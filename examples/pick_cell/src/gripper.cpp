// A gripper on two axes: it goes to where the goal says, closes, and comes back with what it holds.

#include <cmath>

#include <actionlib/server/simple_action_server.h>
#include <pick_cell/PickAction.h>
#include <pick_cell/Take.h>
#include <ros/ros.h>
#include <std_msgs/Float32.h>

class Gripper {
public:
  Gripper()
    : server_(node_, "pick", [this](const pick_cell::PickGoalConstPtr& goal) { pick(*goal); }, false) {
    ros::NodeHandle("~").param("steps_per_second", steps_per_second_, 20.0);
    way_ = node_.advertise<std_msgs::Float32>("gripper/way", 10);
    take_ = node_.serviceClient<pick_cell::Take>("take");
    server_.start();
  }

private:
  void pick(const pick_cell::PickGoal& goal) {
    ros::Rate rate(steps_per_second_);
    pick_cell::PickFeedback feedback;
    const double step = goal.speed / steps_per_second_;
    for (double left = std::hypot(goal.x, goal.y); left > 0.0 && ros::ok(); left -= step) {
      if (server_.isPreemptRequested() || step <= 0.0) {
        server_.setPreempted();
        return;
      }
      std_msgs::Float32 way;
      way.data = feedback.way = static_cast<float>(left);
      way_.publish(way);
      server_.publishFeedback(feedback);
      rate.sleep();
    }
    pick_cell::Take take;
    take.request.x = goal.x;
    take.request.y = goal.y;
    pick_cell::PickResult result;
    result.held = take_.call(take) && take.response.taken;
    server_.setSucceeded(result);
  }

  ros::NodeHandle node_;
  actionlib::SimpleActionServer<pick_cell::PickAction> server_;
  ros::Publisher way_;
  ros::ServiceClient take_;
  double steps_per_second_ = 20.0;
};

int main(int argc, char** argv) {
  ros::init(argc, argv, "gripper");
  Gripper gripper;
  ros::spin();
}
