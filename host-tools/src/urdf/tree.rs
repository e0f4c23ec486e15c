//! The tree of links and joints, and the checks of what URDF demands beyond its XML schema.

use std::collections::{HashMap, HashSet};

use super::document::{FIXED, Joint, Link, Robot};
use super::error::UrdfError;

/// A robot whose links form one tree.
pub(super) struct Tree<'a> {
    robot: &'a Robot,
    links: HashMap<&'a str, &'a Link>,
    /// The joint above each link but the root.
    above: HashMap<&'a str, &'a Joint>,
}

impl<'a> Tree<'a> {
    /// Checks that names are unique, every joint joins two links that exist, no link hangs on two
    /// joints, and all links are reached from one root.
    pub(super) fn new(robot: &'a Robot) -> Result<Self, UrdfError> {
        let mut links = HashMap::new();
        for link in &robot.links {
            if links.insert(link.name.as_str(), link).is_some() {
                return Err(UrdfError::DuplicateLink(link.name.clone()));
            }
        }
        let mut names = HashSet::new();
        let mut above = HashMap::new();
        for joint in &robot.joints {
            if !names.insert(joint.name.as_str()) {
                return Err(UrdfError::DuplicateJoint(joint.name.clone()));
            }
            for end in [&joint.parent, &joint.child] {
                if !links.contains_key(end.as_str()) {
                    return Err(UrdfError::NoSuchEnd {
                        joint: joint.name.clone(),
                        link: end.clone(),
                    });
                }
            }
            if let Some(other) = above.insert(joint.child.as_str(), joint) {
                return Err(UrdfError::TwoParents {
                    link: joint.child.clone(),
                    joints: [other.name.clone(), joint.name.clone()],
                });
            }
        }
        let tree = Self { robot, links, above };
        tree.check_connected()?;
        Ok(tree)
    }

    /// Checks that there is one root, and no link on a ring of joints.
    fn check_connected(&self) -> Result<(), UrdfError> {
        let roots: Vec<_> = self
            .robot
            .links
            .iter()
            .filter(|link| !self.above.contains_key(link.name.as_str()))
            .map(|link| link.name.clone())
            .collect();
        let mut reached: HashSet<&str> = roots.iter().map(String::as_str).collect();
        let mut next: Vec<&str> = reached.iter().copied().collect();
        while let Some(link) = next.pop() {
            for joint in self.joints_below(link) {
                reached.insert(&joint.child);
                next.push(&joint.child);
            }
        }
        match self.robot.links.iter().find(|link| !reached.contains(link.name.as_str())) {
            Some(link) => Err(UrdfError::Cycle(link.name.clone())),
            None if roots.len() > 1 => Err(UrdfError::Roots(roots)),
            None => Ok(()),
        }
    }

    /// The joints from the root to a link.
    pub(super) fn path(&self, link: &str) -> Result<Vec<&'a Joint>, UrdfError> {
        if !self.links.contains_key(link) {
            return Err(UrdfError::NoSuchTcp { name: link.to_owned(), links: self.names() });
        }
        let mut path: Vec<_> = self.up(link).collect();
        path.reverse();
        Ok(path)
    }

    /// The joints from a link to the root.
    fn up(&self, link: &str) -> impl Iterator<Item = &'a Joint> {
        let up = |joint: &&'a Joint| self.above.get(joint.parent.as_str()).copied();
        std::iter::successors(self.above.get(link).copied(), up)
    }

    /// The names of all links, in the order of the file.
    pub(super) fn names(&self) -> Vec<String> {
        self.robot.links.iter().map(|link| link.name.clone()).collect()
    }

    /// The names of the links behind a movable joint that carry no other link.
    pub(super) fn ends(&self) -> Vec<String> {
        let moves = |name: &str| self.up(name).any(|joint| joint.kind != FIXED);
        let is_end = |name: &String| self.joints_below(name).next().is_none() && moves(name);
        self.names().into_iter().filter(is_end).collect()
    }

    /// True if the link has a mass of its own in the file.
    pub(super) fn has_mass(&self, name: &str) -> bool {
        let inertial = self.link(name).and_then(|link| link.inertial.as_ref());
        inertial.is_some_and(|own| own.mass > 0.0)
    }

    /// The link of this name; the tree has one for every end of a joint.
    pub(super) fn link(&self, name: &str) -> Option<&'a Link> {
        self.links.get(name).copied()
    }

    /// The joints that hang on a link, in the order of the file.
    pub(super) fn joints_below(&self, link: &str) -> impl Iterator<Item = &'a Joint> {
        self.robot.joints.iter().filter(move |joint| joint.parent == link)
    }
}
